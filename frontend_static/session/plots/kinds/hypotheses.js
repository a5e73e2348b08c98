/**
 * One component of K hypotheses, each a line from frame to frame that is the more opaque the more probable it is; of the
 * active branch alone. A hypothesis that begins in a frame begins in the middle before it.
 */

import { number, quantity, smallestSpan } from "../../../shared/format.js";
import { isGone } from "../../history.js";
import { valueOf } from "../../series.js";
import { Lines } from "../figure.js";
import { Plot } from "./plot.js";

const DASHES = [4, 3];
/** What is hardly probable at all is still seen. */
const FAINTEST = 0.06;

export class HypothesesPlot extends Plot {
  #lines;
  #truth;

  reading({ session, history }) {
    return mostProbable(history.at(session.position), this.declared);
  }

  build(Bokeh, frames) {
    super.build(Bokeh, frames);
    const { figure, declared } = this;
    const make = (source) => ({ active: [figure.segments(source, { name: this.id, tags: ["branch"] })] });
    this.#lines = new Lines(figure, (history, from) => segments(history, from, declared), make, ["y0", "y1"]);
    const truth = (source) => ({
      active: [figure.line(source, "truth", { line_color: figure.ink.truth, line_dash: DASHES, line_width: 1.2 })],
    });
    this.#truth = new Lines(figure, (history, from) => truths(history, from, declared.truth), truth);
    figure.shade("lost", 0.16, isGone);
  }

  dress(ink, sparkline) {
    super.dress(ink, sparkline);
    for (const line of this.#truth.ofActive) line.glyph.line_color = ink.truth;
  }

  draw(store) {
    super.draw(store);
    this.#lines.draw(store);
    this.#truth.draw(store);
    const [first, second] = [this.#lines.extent, this.#truth.extent];
    const extent = [Math.min(first[0], second[0]), Math.max(first[1], second[1])];
    this.figure.enclose(extent, smallestSpan(this.declared.unit));
  }
}

/** The component of the most probable hypothesis, and how probable it is. */
export function mostProbable(row, { series: [name], component = 0, unit }) {
  const found = row?.series?.[name];
  if (!found?.weights?.length) return number(null);
  const best = found.weights.indexOf(Math.max(...found.weights));
  const value = `${quantity(found.values[best][component], unit)} ${unit}`.trim();
  return `${value}, ${number(100 * found.weights[best], 0)} %, one of ${found.weights.length}`;
}

/** From where each hypothesis was in the frame before to where it is, of the frames from one on. */
export function segments(history, from, { series: [name], component = 0 }) {
  /** @type {Record<string, number[]>} */
  const data = { frame: [], x1: [], y0: [], y1: [], alpha: [] };
  for (let frame = from; frame < history.length; frame += 1) {
    const found = history.at(frame)?.series?.[name];
    const before = history.at(frame - 1)?.series?.[name];
    (found?.values ?? []).forEach((value, place) => {
      const earlier = before?.values?.[place]?.[component];
      data.frame.push(earlier === undefined ? frame - 0.5 : frame - 1);
      data.x1.push(frame);
      data.y0.push(earlier ?? value[component]);
      data.y1.push(value[component]);
      data.alpha.push(FAINTEST + (1 - FAINTEST) * found.weights[place]);
    });
  }
  return data;
}

function truths(history, from, name) {
  /** @type {Record<string, number[]>} */
  const data = { frame: [], truth: [] };
  for (let frame = from; frame < history.length; frame += 1) {
    data.frame.push(frame);
    data.truth.push(valueOf(history.at(frame), name));
  }
  return data;
}
