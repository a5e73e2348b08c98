/** Shades of the intervals in which something held, of the active branch. */

/** @import { Spans } from "../../shared/figure/traces.js" */
/** @import { Row } from "../history.js" */
/** @import { Store } from "../store.js" */

/** @typedef {(row: Row, place: number) => boolean} Test Of a frame and, where there are rows, one of them. */

export class Shades {
  #test;
  #rows;
  #seen = "";
  /** @type {Spans} */
  #trace;

  /**
   * @param {string} ink
   * @param {number} opacity
   * @param {Test} test
   * @param {number} [rows] How many rows are shaded apart.
   */
  constructor(ink, opacity, test, rows = 1) {
    this.#test = test;
    this.#rows = rows;
    this.#trace = { kind: "spans", title: "", name: ink, ink, opacity, intervals: [] };
  }

  /**
   * The shades as they are now.
   *
   * @param {Pick<Store, "known"|"history">} store
   */
  trace({ known, history }) {
    const seen = `${known.branch} ${history.edition} ${history.length}`;
    if (seen === this.#seen) return this.#trace;
    this.#seen = seen;
    const intervals = Array.from({ length: this.#rows }, (_, place) => {
      const part = this.#rows > 1 ? { low: place, high: place + 1 } : {};
      return history.spans((row) => this.#test(row, place)).map(([first, last]) => ({ first: first - 0.5, last: last + 0.5, ...part }));
    });
    this.#trace = { ...this.#trace, intervals: intervals.flat() };
    return this.#trace;
  }
}
