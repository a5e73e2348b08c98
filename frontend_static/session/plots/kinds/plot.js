/**
 * What a kind of plot is: the words above it, known from the start, and its figure, made when BokehJS is there.
 */

import { Figure } from "../figure.js";

/** @import { Plot as Declared, SessionPublic } from "../../../shared/messages.js" */
/** @import { Curve, History } from "../../history.js" */
/** @import { View } from "../../mount.js" */
/** @import { Store } from "../../store.js" */
/** @import { BokehApi, Range } from "../bokeh_api.js" */
/** @import { Ink, Ticks } from "../figure.js" */

export class Plot {
  /** How many rows it has, one above the other. */
  rows = 1;
  /** Names of rows with what they mean, where the names are short.
   *
   * @type {[name: string, words: string][]}
   */
  rowTitles = [];
  /** @type {Figure|null} */
  #figure = null;

  /**
   * @param {Declared} declared As the experiment declares it.
   * @param {SessionPublic} session
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

  /** The figure, once it is made. */
  get figure() {
    return made(this.#figure);
  }

  /**
   * Whether any branch has something to draw.
   *
   * @param {History[]} histories
   */
  isMeasured(histories) {
    const { needs } = this;
    return needs === null || histories.some((history) => needs.some((name) => history.measures(name)));
  }

  /**
   * The title.
   *
   * @param {Store} store
   * @returns {(string|Node)[]}
   */
  heading(store) {
    void store;
    return [`${this.declared.title} ${this.declared.unit}`.trim()];
  }

  /**
   * The figures of the frame that is shown.
   *
   * @param {Store} store
   * @returns {string}
   */
  reading(store) {
    void store;
    return "";
  }

  /**
   * Make the figure.
   *
   * @param {BokehApi} Bokeh
   * @param {Range} frames
   * @param {Ticks} [ticks]
   */
  build(Bokeh, frames, ticks) {
    this.#figure = new Figure(Bokeh, frames, ticks);
  }

  /**
   * Take over the colours of the theme.
   *
   * @param {Ink} ink
   * @param {boolean} sparkline
   */
  dress(ink, sparkline) {
    this.figure.dress(ink, sparkline);
  }

  /**
   * Take what a person does in the figure, where that means something.
   *
   * @param {HTMLElement} place Of the figure.
   * @param {View} view
   */
  listen(place, view) {
    void [place, view];
  }

  /** @param {Store} store */
  draw(store) {
    this.figure.draw(store);
  }
}

/**
 * What is made when BokehJS is there, and asked for only then.
 *
 * @template Thing
 * @param {Thing|null} thing
 */
export function made(thing) {
  if (thing === null) throw new Error("The figure has not been made yet");
  return thing;
}

/**
 * The data of the frames from one on, a column for each function of a row.
 *
 * @param {History} history
 * @param {number} from
 * @param {Record<string, Curve>} values
 */
export function columns(history, from, values) {
  /** @type {Record<string, number[]>} */
  const data = { frame: [] };
  for (let frame = from; frame < history.length; frame += 1) data.frame.push(frame);
  for (const [name, value] of Object.entries(values)) data[name] = data.frame.map((frame) => value(history.at(frame)) ?? NaN);
  return data;
}
