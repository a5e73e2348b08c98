/**
 * One request at a time, and of all that is wished for meanwhile only the newest: a slider that is dragged never queues.
 * While the server does not answer, the newest wish is tried again and again.
 */

import { statusOf } from "../shared/api.js";
import { Backoff } from "../shared/socket.js";
import { after } from "../shared/timing.js";

/**
 * @template Wish, Answer
 * @typedef {object} Listener
 * @property {(answer: Answer, wish: Wish, isNewest: boolean) => unknown} answer The next request begins when it has settled.
 * @property {(error: unknown, wish: Wish) => void} refused
 * @property {(isLost: boolean) => void} lost Whether the server is gone.
 */

/** @template Wish, Answer */
export class NewestRequest {
  #send;
  #on;
  #signal;
  #pause;
  /** @type {{wish: Wish}|null} */
  #waiting = null;
  #isBusy = false;
  #isLost = false;
  #backoff = new Backoff();

  /**
   * @param {(wish: Wish) => Promise<Answer>} send
   * @param {Listener<Wish, Answer>} on
   * @param {AbortSignal} signal Nothing is sent or told after it.
   * @param {(milliseconds: number, signal: AbortSignal) => Promise<unknown>} [pause]
   */
  constructor(send, on, signal, pause = after) {
    this.#send = send;
    this.#on = on;
    this.#signal = signal;
    this.#pause = pause;
  }

  /** @param {Wish} wish */
  ask(wish) {
    this.#waiting = { wish };
    if (!this.#isBusy) this.#work();
  }

  async #work() {
    this.#isBusy = true;
    while (this.#waiting !== null && !this.#signal.aborted) {
      const { wish } = this.#waiting;
      this.#waiting = null;
      const found = await this.#tried(wish);
      if (this.#signal.aborted) return;
      if (found === "lost") {
        await this.#pause(this.#backoff.next(), this.#signal);
        this.#waiting ??= { wish };
      }
    }
    this.#isBusy = false;
  }

  /**
   * @param {Wish} wish
   * @returns {Promise<"told"|"lost">}
   */
  async #tried(wish) {
    try {
      const answer = await this.#send(wish);
      if (this.#signal.aborted) return "told";
      this.#found(true);
      await this.#on.answer(answer, wish, this.#waiting === null);
    } catch (error) {
      if (this.#signal.aborted) return "told";
      const isLost = statusOf(error) === 0;
      this.#found(!isLost);
      if (isLost) return "lost";
      this.#on.refused(error, wish);
    }
    return "told";
  }

  /** @param {boolean} isThere Whether the server has answered. */
  #found(isThere) {
    if (this.#isLost === !isThere) return;
    this.#isLost = !isThere;
    this.#backoff.reset();
    this.#on.lost(this.#isLost);
  }
}
