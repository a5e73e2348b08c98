/**
 * One request at a time, and then only the newest wish: a slider that is dragged never queues. A listener that wants to know
 * whether the server is gone has the newest wish tried again until the server answers.
 */

import { statusOf } from "./api.js";
import { Backoff } from "./socket.js";
import { after } from "./timing.js";

/**
 * @template Wish, Answer
 * @typedef {object} Listener
 * @property {(answer: Answer, wish: Wish, isNewest: boolean) => unknown} [answer] The next request begins when it has settled.
 * @property {(error: unknown, wish: Wish) => void} [refused] Without it `ask` rejects.
 * @property {(isLost: boolean) => void} [lost] Whether the server is gone.
 * @property {(waiting: Wish, newer: Wish) => Wish} [join] What is left of two wishes; the newer one if not given.
 */

/** @template Wish, Answer */
export class NewestRequest {
  #send;
  #on;
  #signal;
  #pause;
  /** @type {{wish: Wish}|null} */
  #waiting = null;
  /** @type {Promise<void>|null} */
  #working = null;
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

  /**
   * @param {Wish} wish
   * @returns {Promise<void>} Resolves when nothing is on its way and nothing waits.
   */
  ask(wish) {
    const { join } = this.#on;
    this.#waiting = { wish: join && this.#waiting ? join(this.#waiting.wish, wish) : wish };
    return (this.#working ??= this.#work());
  }

  async #work() {
    try {
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
    } finally {
      this.#working = null;
      // What was refused keeps nothing back.
      if (this.#waiting !== null && !this.#signal.aborted) this.ask(this.#waiting.wish);
    }
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
      await this.#on.answer?.(answer, wish, this.#waiting === null);
    } catch (error) {
      if (this.#signal.aborted) return "told";
      const isLost = this.#on.lost !== undefined && statusOf(error) === 0;
      this.#found(!isLost);
      if (isLost) return "lost";
      if (this.#on.refused === undefined) throw error;
      this.#on.refused(error, wish);
    }
    return "told";
  }

  /** @param {boolean} isThere Whether the server has answered. */
  #found(isThere) {
    if (this.#isLost === !isThere) return;
    this.#isLost = !isThere;
    this.#backoff.reset();
    this.#on.lost?.(this.#isLost);
  }
}
