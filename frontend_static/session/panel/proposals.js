/**
 * What the panel proposes: the newest value of each parameter, one request at a time. Until the last of them has been
 * answered and the session's own word has come, what is proposed is not torn out of the hand.
 */

import { later } from "../../shared/timing.js";

/** The session's word comes by the stream, mostly before the answer to the request, sometimes a little after it. */
const REST_MS = 300;

/** @import { Value } from "../../shared/format.js" */

export class Proposals {
  #send;
  #onSettled;
  #signal;
  /** @type {Map<string, Value>} */
  #waiting = new Map();
  /** @type {Set<string>} */
  #held = new Set();
  #isBusy = false;
  #stopRest = () => {};

  /**
   * @param {(values: Record<string, Value>) => Promise<boolean>} send Tells whether the values were accepted.
   * @param {() => void} onSettled Called when nothing is proposed any more: every control shows what is in force then.
   * @param {AbortSignal} signal
   */
  constructor(send, onSettled, signal) {
    this.#send = send;
    this.#onSettled = onSettled;
    this.#signal = signal;
  }

  /**
   * Whether a value of this parameter is on its way.
   *
   * @param {string} name
   */
  holds(name) {
    return this.#held.has(name);
  }

  /**
   * @param {string} name
   * @param {Value} value
   */
  propose(name, value) {
    this.#waiting.set(name, value);
    this.#held.add(name);
    this.#stopRest();
    if (!this.#isBusy) this.#pump();
  }

  async #pump() {
    this.#isBusy = true;
    let accepted = true;
    while (this.#waiting.size > 0 && !this.#signal.aborted) {
      const values = Object.fromEntries(this.#waiting);
      this.#waiting.clear();
      accepted = await this.#send(values);
    }
    this.#isBusy = false;
    if (accepted) this.#stopRest = later(() => this.#settle(), REST_MS, this.#signal);
    else this.#settle();
  }

  #settle() {
    this.#held.clear();
    this.#onSettled();
  }
}
