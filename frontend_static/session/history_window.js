/** A part of a run's history as if it were all of it: so many frames from one on, counted from 0. */

import { History } from "./history.js";

/** @import { Row } from "./history.js" */

export class HistoryWindow extends History {
  #whole;
  #first;
  #frames;

  /**
   * @param {() => History} whole The history as it is now.
   * @param {number} first The frame of it that is frame 0 here.
   * @param {() => number} frames How many there are at most.
   */
  constructor(whole, first, frames) {
    super();
    this.#whole = whole;
    this.#first = first;
    this.#frames = frames;
  }

  get edition() {
    return this.#whole().edition;
  }

  get length() {
    return Math.min(Math.max(0, this.#whole().length - this.#first), this.#frames());
  }

  /**
   * @param {number} frame
   * @returns {Row|undefined}
   */
  at(frame) {
    return frame < this.length ? this.#whole().at(frame + this.#first) : undefined;
  }

  /** @param {string} name */
  measures(name) {
    return this.#whole().measures(name);
  }
}
