/** Rate limits and waits. Each wait ends with its signal, so that a removed part of a page leaves no timer behind. */

import { effect, untracked } from "../vendor/preact.js";
import { statusOf } from "./api.js";
import { Backoff } from "./stream.js";

/** Run `work` at most once per frame of the display, however often it is requested.
 *
 * @param {() => void} work
 * @param {AbortSignal} [signal] Nothing runs after it.
 * @returns {() => void}
 */
export function coalesce(work, signal) {
  let asked = 0;
  signal?.addEventListener("abort", () => cancelAnimationFrame(asked));
  return () => {
    if (asked !== 0 || signal?.aborted) return;
    asked = requestAnimationFrame(() => {
      asked = 0;
      work();
    });
  };
}

/**
 * Run `work` at most every `milliseconds`, the last request always being served.
 *
 * @param {() => void} work
 * @param {number} milliseconds
 * @param {AbortSignal} [signal] Nothing runs after it.
 * @returns {() => void}
 */
export function throttle(work, milliseconds, signal) {
  let last = 0;
  let timer = 0;
  const now = () => {
    timer = 0;
    last = performance.now();
    work();
  };
  signal?.addEventListener("abort", () => clearTimeout(timer));
  return () => {
    if (timer !== 0 || signal?.aborted) return;
    timer = setTimeout(now, Math.max(0, last + milliseconds - performance.now()));
  };
}

/**
 * Run `work` after a while, unless the signal ends the waiting.
 *
 * @param {() => void} work
 * @param {number} milliseconds
 * @param {AbortSignal} [signal]
 * @returns {() => void} Ends the waiting, too.
 */
export function later(work, milliseconds, signal) {
  if (signal?.aborted) return () => {};
  const stop = () => {
    clearTimeout(timer);
    signal?.removeEventListener("abort", stop);
  };
  const timer = setTimeout(() => {
    stop();
    work();
  }, milliseconds);
  signal?.addEventListener("abort", stop);
  return stop;
}

/**
 * Resolves after a while; never after the signal.
 *
 * @param {number} milliseconds
 * @param {AbortSignal} [signal]
 * @returns {Promise<void>}
 */
export function after(milliseconds, signal) {
  return new Promise((resolve) => {
    later(resolve, milliseconds, signal);
  });
}

// One request at a time, and then only the newest wish: a dragged slider never queues. With a `lost` callback, the newest wish is tried
// again until the server answers.

/**
 * @template Wish, Answer
 * @typedef {object} Listener
 * @property {(answer: Answer, wish: Wish, isNewest: boolean) => unknown} [answer] The next request begins when it has settled.
 * @property {(error: unknown, wish: Wish) => void} [refused] Without it `ask` rejects.
 * @property {(isLost: boolean) => void} [lost] Called when the server is gone or back.
 * @property {(waiting: Wish, newer: Wish) => Wish} [join] Merges two wishes; by default the newer one.
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
   * @param {AbortSignal} signal Nothing is sent or reported after it.
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
        await this.#try(wish);
      }
    } finally {
      this.#working = null;
      // A refused wish does not block later ones.
      if (this.#waiting !== null && !this.#signal.aborted) this.ask(this.#waiting.wish);
    }
  }

  /** @param {Wish} wish */
  async #try(wish) {
    try {
      const answer = await this.#send(wish);
      if (this.#signal.aborted) return;
      this.#found(true);
      await this.#on.answer?.(answer, wish, this.#waiting === null);
    } catch (error) {
      if (this.#signal.aborted) return;
      const isLost = this.#on.lost !== undefined && statusOf(error) === 0;
      this.#found(!isLost);
      if (isLost) {
        await this.#pause(this.#backoff.next(), this.#signal);
        this.#waiting ??= { wish };
      } else if (this.#on.refused === undefined) throw error;
      else this.#on.refused(error, wish);
    }
  }

  /** @param {boolean} isThere Whether the server has answered. */
  #found(isThere) {
    if (this.#isLost === !isThere) return;
    this.#isLost = !isThere;
    this.#backoff.reset();
    this.#on.lost?.(this.#isLost);
  }
}

// Signals outside components: effects of a change, and waiting for a value.

/**
 * Run `act` now and whenever a signal changes that `look` reads.
 *
 * @param {() => unknown} look
 * @param {() => void} act May read and change signals: those do not count.
 * @param {AbortSignal} end Nothing runs after it.
 */
export function follow(look, act, end) {
  if (end.aborted) return;
  const stop = effect(() => {
    look();
    untracked(act);
  });
  end.addEventListener("abort", stop);
}

/**
 * Resolves as soon as something holds; never after the end.
 *
 * @param {() => unknown} holds Reads signals.
 * @param {AbortSignal} end
 * @returns {Promise<void>}
 */
export function until(holds, end) {
  return new Promise((resolve) => {
    // Once it holds, no signals are read or followed.
    let isSo = false;
    follow(() => (isSo ||= Boolean(holds())), () => isSo && resolve(), end);
  });
}
