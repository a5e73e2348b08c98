/** Numbers with a limit over the last frames, such as the normalised innovation squared of a Kalman filter. */

import { fill, h } from "../../shared/dom.js";
import { FigureView } from "../../shared/figure/figure.js";

/** @import { Course, InspectionPublic } from "../../shared/messages.js" */
/** @import { Panel } from "../../shared/figure/traces.js" */

const LETTERS = 11 / 16;
const SPACE = 1.1;

export class Courses {
  #place;
  #figure;
  #title = h("h3", {});

  /**
   * @param {HTMLElement} place
   * @param {AbortSignal} signal
   */
  constructor(place, signal) {
    this.#place = place;
    const drawing = h("div", { class: "lineage", role: "img", "aria-label": "The number over the last frames, and its limit" });
    fill(place, this.#title, drawing);
    this.#figure = new FigureView(drawing, {}, signal, { isCompact: true, letters: LETTERS });
  }

  /** @param {InspectionPublic} found */
  show({ courses }) {
    this.#place.hidden = courses.length === 0;
    if (this.#place.hidden) return;
    fill(this.#title, courses.map(({ title }) => title).join(", "));
    this.#figure.show({ panels: courses.map(panel) }, { locked: true });
  }
}

/**
 * @param {Course} course
 * @param {number} row
 * @returns {Panel}
 */
function panel({ title, limit, first, values }, row) {
  const x = values.map((_, place) => first + place);
  const y = values.map((value) => value ?? NaN);
  const base = { title: "", unit: "", log: false, names: [], hidden: false };
  const last = first + values.length - 1;
  const line = /** @type {const} */ ({ kind: "line", title: "", unit: "", width: 1.8 });
  return {
    ...{ id: title, title: "", handles: [], words: "", row, share: [1, 1] },
    x: { ...base, low: first, high: last },
    y: { ...base, low: 0, high: SPACE * Math.max(limit, ...y.filter(Number.isFinite)) },
    traces: [
      { ...line, name: `${title} limit`, ink: "muted", dashed: true, x: [first, last], y: [limit, limit], said: "" },
      { ...line, name: title, ink: "estimate", x, y, said: title },
    ],
  };
}
