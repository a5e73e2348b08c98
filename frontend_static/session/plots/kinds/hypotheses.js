/**
 * One component of K hypotheses, each a line from frame to frame that is the more opaque the more probable it is; of the
 * active branch alone. A hypothesis that begins in a frame begins in the middle before it.
 */

import { number, quantity, smallestSpan } from "../../../shared/format.js";
import { isGone } from "../../history.js";
import { hypothesesOf, valueOf } from "../../series.js";
import { Lines } from "../lines.js";
import { Plot, made } from "./plot.js";

/** @import { Plot as Declared } from "../../../shared/messages.js" */
/** @import { History, Row } from "../../history.js" */
/** @import { Store } from "../../store.js" */
/** @import { BokehApi, Range } from "../bokeh_api.js" */
/** @import { Ink } from "../figure.js" */

/** @typedef {{series: string[], component?: number}} Chosen A series, and which component of it. */

const DASHES = [4, 3];
/** What is hardly probable at all is still seen. */
const FAINTEST = 0.06;

export class HypothesesPlot extends Plot {
  /** @type {Lines|null} */
  #lines = null;
  /** @type {Lines|null} */
  #truth = null;

  /** @param {Store} store */
  reading({ known, history }) {
    return mostProbable(history.at(known.position), this.declared);
  }

  /**
   * @param {BokehApi} Bokeh
   * @param {Range} frames
   */
  build(Bokeh, frames) {
    super.build(Bokeh, frames);
    const { figure, declared } = this;
    this.#lines = new Lines(
      figure,
      (history, from) => segments(history, from, declared),
      (source) => ({ active: [figure.segments(source, { name: this.id, tags: ["branch"] })] }),
      ["y0", "y1"],
    );
    this.#truth = new Lines(
      figure,
      (history, from) => truths(history, from, declared.truth),
      (source) => ({ active: [figure.line(source, "truth", { line_color: figure.ink.truth, line_dash: DASHES, line_width: 1.2 })] }),
    );
    figure.shade("lost", 0.16, isGone);
  }

  /**
   * @param {Ink} ink
   * @param {boolean} sparkline
   */
  dress(ink, sparkline) {
    super.dress(ink, sparkline);
    for (const line of made(this.#truth).ofActive) line.glyph.line_color = ink.truth;
  }

  /** @param {Store} store */
  draw(store) {
    super.draw(store);
    const both = [made(this.#lines), made(this.#truth)];
    for (const lines of both) lines.draw(store);
    const [first, second] = both.map(({ extent }) => extent);
    this.figure.enclose([Math.min(first[0], second[0]), Math.max(first[1], second[1])], smallestSpan(this.declared.unit));
  }
}

/**
 * The component of the most probable hypothesis, and how probable it is.
 *
 * @param {Row|undefined} row
 * @param {Chosen & {unit: string}} declared
 */
export function mostProbable(row, { series: [name], component = 0, unit }) {
  const { values, weights } = knownOf(row, name);
  if (weights.length === 0) return number(null);
  const best = weights.indexOf(Math.max(...weights));
  const value = `${quantity(values[best][component], unit)} ${unit}`.trim();
  return `${value}, ${number(100 * weights[best], 0)} %, one of ${weights.length}`;
}

/**
 * From where each hypothesis was in the frame before to where it is, of the frames from one on.
 *
 * @param {History} history
 * @param {number} from
 * @param {Chosen} declared
 */
export function segments(history, from, { series: [name], component = 0 }) {
  /** @type {Record<string, number[]>} */
  const data = { frame: [], x1: [], y0: [], y1: [], alpha: [] };
  for (let frame = from; frame < history.length; frame += 1) {
    const { values, weights } = knownOf(history.at(frame), name);
    const before = knownOf(history.at(frame - 1), name).values;
    values.forEach((value, place) => {
      const earlier = before[place]?.[component] ?? NaN;
      const begins = Number.isNaN(earlier);
      data.frame.push(begins ? frame - 0.5 : frame - 1);
      data.x1.push(frame);
      data.y0.push(begins ? value[component] : earlier);
      data.y1.push(value[component]);
      data.alpha.push(FAINTEST + (1 - FAINTEST) * weights[place]);
    });
  }
  return data;
}

/**
 * The hypotheses of a frame, with NaN for what is not known of one; none where the frame has none.
 *
 * @param {Row|undefined} row
 * @param {string} name
 */
function knownOf(row, name) {
  const { values = [], weights = [] } = hypothesesOf(row, name) ?? {};
  return { values: values.map((value) => value.map((each) => each ?? NaN)), weights: weights.map((weight) => weight ?? 0) };
}

/**
 * @param {History} history
 * @param {number} from
 * @param {string} name
 */
function truths(history, from, name) {
  /** @type {Record<string, number[]>} */
  const data = { frame: [], truth: [] };
  for (let frame = from; frame < history.length; frame += 1) {
    data.frame.push(frame);
    data.truth.push(valueOf(history.at(frame), name));
  }
  return data;
}
