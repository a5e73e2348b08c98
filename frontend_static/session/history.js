/**
 * What is known of each frame of one branch: the diagnostics in columns, row i belonging to frame i.
 */

import { signal } from "../vendor/preact.js";
import { isKnown } from "./series.js";

/** @import { SeriesValue } from "./series.js" */

/**
 * What the server tells of a frame, as `Diagnostics` of the library has it; null where a thing is not known.
 *
 * @typedef {object} Row
 * @property {number} frame
 * @property {(number|null)[]} estimate
 * @property {(number|null)[]} sigma
 * @property {number|null} log_evidence
 * @property {number|null} error
 * @property {boolean|null} lost
 * @property {boolean|null} hidden
 * @property {boolean|null} searching
 * @property {"truth"|"tracker"|""} lost_by Who says whether the target is lost; empty where nobody does.
 * @property {number|null} lost_since Frame in which the loss began that goes on here.
 * @property {number|null} step_ms
 * @property {Record<string, SeriesValue>} series
 */

/** @typedef {(row: Row|undefined) => number|null} Curve A number of a row; null where it is not known. */

export class History {
  /** @type {Row[]} */
  #rows = [];
  /** @type {Set<string>} */
  #measured = new Set();
  #edition = signal(0);
  /** Counts every change, so that components that read rows follow them. */
  #changes = signal(0);

  /** Counts every change that is not an appended row; a plot that saw the same count only has to add the tail. */
  get edition() {
    return this.#edition.value;
  }

  get length() {
    return this.#changes.value && this.#rows.length;
  }

  /**
   * The diagnostics of a frame, or undefined where it has not been computed.
   *
   * @param {number} frame
   * @returns {Row|undefined}
   */
  at(frame) {
    return this.#changes.value > 0 ? this.#rows[frame] : undefined;
  }

  /**
   * Forget everything and take over what the server sends, column by column.
   *
   * @param {Record<string, unknown[]>} columns
   */
  replace(columns) {
    this.#rows = [];
    this.#measured.clear();
    this.merge(columns);
  }

  /**
   * Begin like another history, up to and including a frame.
   *
   * @param {History} parent
   * @param {number} frame
   */
  share(parent, frame) {
    this.#rows = parent.#rows.slice(0, frame + 1);
    this.#measured.clear();
    for (const row of this.#rows) this.#note(row);
    this.#tell(true);
  }

  /**
   * Fill in what the server sends; rows that came by the stream in the meantime stay.
   *
   * @param {Record<string, unknown[]>} columns
   */
  merge(columns) {
    const names = Object.keys(columns);
    for (let index = 0; index < (columns.frame?.length ?? 0); index += 1) {
      const row = /** @type {Row} */ (Object.fromEntries(names.map((name) => [name, columns[name][index]])));
      this.#rows[row.frame] = row;
      this.#note(row);
    }
    this.#tell(true);
  }

  /**
   * Add a row, or see an old one again (a replay gives the same numbers).
   *
   * @param {Row} row
   * @returns {boolean} False when rows in between are missing, so that the whole history has to be fetched.
   */
  add(row) {
    const whole = row.frame <= this.#rows.length;
    const isOther = row.frame < this.#rows.length && row.estimate?.[0] !== this.#rows[row.frame]?.estimate?.[0];
    this.#rows[row.frame] = row;
    this.#note(row);
    this.#tell(isOther);
    return whole;
  }

  /** @param {boolean} isOther Whether more has changed than that a row was added. */
  #tell(isOther) {
    this.#changes.value = this.#changes.peek() + 1;
    if (isOther) this.#edition.value = this.#edition.peek() + 1;
  }

  /**
   * Whether any frame has a known value of a series.
   *
   * @param {string} name
   */
  measures(name) {
    return this.#changes.value > 0 && this.#measured.has(name);
  }

  /** @param {Row|undefined} row */
  #note(row) {
    for (const [name, value] of Object.entries(row?.series ?? {})) {
      if (!this.#measured.has(name) && isKnown(value)) this.#measured.add(name);
    }
  }

  /**
   * Spans [first, last] of frames for which `test` holds.
   *
   * @param {(row: Row) => boolean} test
   */
  spans(test) {
    /** @type {[number, number][]} */
    const found = [];
    let first = -1;
    for (let frame = 0; frame <= this.length; frame += 1) {
      const row = this.at(frame);
      const holds = row !== undefined && test(row);
      if (holds && first < 0) first = frame;
      if (!holds && first >= 0) {
        found.push([first, frame - 1]);
        first = -1;
      }
    }
    return found;
  }

  /**
   * Whether `test` holds for any frame.
   *
   * @param {(row: Row) => boolean} test
   */
  some(test) {
    for (let frame = 0; frame < this.length; frame += 1) {
      const row = this.at(frame);
      if (row !== undefined && test(row)) return true;
    }
    return false;
  }

  /**
   * Largest of the numbers that `value` gives, over the frames from..to; null where there is none.
   *
   * @param {Curve} value
   */
  most(value, from = 0, to = this.length - 1) {
    /** @type {number|null} */
    let most = null;
    for (let frame = from; frame <= to; frame += 1) {
      const number = value(this.at(frame));
      if (number !== null && (most === null || number > most)) most = number;
    }
    return most;
  }
}

/** A part of a run's history as if it were all of it: so many frames from one on, counted from 0. */
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

/**
 * The curves that every method has.
 *
 * @type {Record<"error"|"sigma", Curve>}
 */
export const curve = {
  error: (row) => finite(row?.error),
  /** A filter switches as soon as any component spreads too far, so the largest one is the one to look at. */
  sigma: (row) => finite(Math.max(...(row?.sigma ?? []).filter((value) => value !== null))),
};

/**
 * Whether the target is lost, by truth or by the tracker.
 *
 * @param {Row|undefined} row
 */
export function isGone(row) {
  return typeof row?.lost_since === "number";
}

/**
 * @param {unknown} value
 * @returns {number|null}
 */
function finite(value) {
  return typeof value === "number" && Number.isFinite(value) ? value : null;
}
