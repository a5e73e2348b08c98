/**
 * What a kind of plot is: the words above it, known from the start, and its figure, made when BokehJS is there.
 */

import { Figure } from "../figure.js";

export class Plot {
  /** How many rows it has, one above the other. */
  rows = 1;
  /** @type {Figure} */
  figure;

  /**
   * @param {object} declared As the experiment declares it.
   * @param {object} session
   */
  constructor(declared, session) {
    this.declared = declared;
    this.session = session;
    this.id = declared.id;
  }

  /**
   * Names of series of which at least one has to be measured for there to be something to draw; null if it needs none.
   *
   * @returns {string[]|null}
   */
  get needs() {
    return this.declared.series;
  }

  /** Whether any branch has something to draw. */
  isMeasured(histories) {
    const { needs } = this;
    return needs === null || histories.some((history) => needs.some((name) => history.measures(name)));
  }

  /**
   * The title.
   *
   * @returns {(string|Node)[]}
   */
  heading() {
    return [`${this.declared.title} ${this.declared.unit}`.trim()];
  }

  /**
   * The figures of the frame that is shown.
   *
   * @param {import("../../store.js").Store} store
   * @returns {string}
   */
  reading(store) {
    void store;
    return "";
  }

  /** Make the figure. */
  build(Bokeh, frames, axis) {
    this.figure = new Figure(Bokeh, frames, axis);
  }

  /** Take over the colours of the theme. */
  dress(ink, sparkline) {
    this.figure.dress(ink, sparkline);
  }

  draw(store) {
    this.figure.draw(store);
  }
}

/** The data of the frames from one on, a column for each function of a row. */
export function columns(history, from, values) {
  /** @type {Record<string, number[]>} */
  const data = { frame: [] };
  for (let frame = from; frame < history.length; frame += 1) data.frame.push(frame);
  for (const [name, value] of Object.entries(values)) data[name] = data.frame.map((frame) => value(history.at(frame)) ?? NaN);
  return data;
}
