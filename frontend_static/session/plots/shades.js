/** Shades of the intervals in which something held, of the active branch. */

/** @import { Row } from "../history.js" */
/** @import { Store } from "../store.js" */
/** @import { Look, Source } from "./bokeh_api.js" */
/** @import { Figure } from "./figure.js" */

/** @typedef {(row: Row, place: number) => boolean} Test Of a frame and, where there are rows, one of them. */

export class Shades {
  #source;
  #test;
  /** @type {string|null} */
  #seen = null;

  /**
   * @param {Figure} figure
   * @param {string} token Name of its colour.
   * @param {number} opacity
   * @param {Test} test
   * @param {number} rows How many rows are shaded apart.
   */
  constructor(figure, token, opacity, test, rows = 1) {
    this.#source = figure.source({ left: [], right: [], top: [], bottom: [] });
    this.#test = test;
    this.token = token;
    this.rows = rows;
    const [left, right, top, bottom] = ["left", "right", "top", "bottom"].map((field) => ({ field }));
    /** @type {Look & {source: Source}} */
    const look = { source: this.#source, fill_alpha: opacity, line_color: null, level: "underlay" };
    this.renderer = rows > 1 ? figure.model.quad({ left, right, top, bottom, ...look }) : figure.model.vstrip(left, right, look);
  }

  /** @param {Store} store */
  draw({ known, history }) {
    const seen = `${known.branch} ${history.edition} ${history.length}`;
    if (seen === this.#seen) return;
    this.#seen = seen;
    /** @type {Record<"left"|"right"|"top"|"bottom", number[]>} */
    const data = { left: [], right: [], top: [], bottom: [] };
    for (let place = 0; place < this.rows; place += 1) {
      for (const [first, last] of history.spans((row) => this.#test(row, place))) {
        data.left.push(first - 0.5);
        data.right.push(last + 0.5);
        data.top.push(place);
        data.bottom.push(place + 1);
      }
    }
    // Most frames begin and end nothing, but for the interval that is under way.
    if (JSON.stringify(data) !== JSON.stringify(this.#source.data)) this.#source.data = data;
  }
}
