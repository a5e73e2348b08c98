/**
 * One component of K hypotheses, each a line from frame to frame that is the more opaque the more probable it is; of the
 * active branch alone. A hypothesis that begins in a frame begins in the middle before it.
 */

import { number, quantity, smallestSpan } from "../../../shared/format.js";
import { isGone } from "../../history.js";
import { hypothesesOf, valueOf } from "../../series.js";
import { BranchColumns } from "../branch_columns.js";
import { enclose } from "../limits.js";
import { Shades } from "../shades.js";
import { Plot, columns } from "./plot.js";

/** @import { Plot as Declared } from "../../../shared/messages.js" */
/** @import { History, Row } from "../../history.js" */
/** @import { Store } from "../../store.js" */
/** @import { Trace } from "../../../shared/figure/traces.js" */
/** @import { Columns } from "../branch_columns.js" */
/** @import { Limits } from "./plot.js" */

/** @typedef {{series: string[], component?: number}} Chosen A series, and which component of it. */

/** What is hardly probable at all is still seen. */
const FAINTEST = 0.06;

export class HypothesesPlot extends Plot {
  #hypotheses = new BranchColumns((history, from) => segments(history, from, this.declared), { limits: ["y0", "y1"], onlyActive: true });
  #truth = new BranchColumns((history, from) => columns(history, from, { truth: (row) => valueOf(row, this.declared.truth) }), { onlyActive: true });
  shades = [new Shades("lost", 0.16, isGone)];

  /** @param {Store} store */
  reading({ known, history }) {
    return mostProbable(history.at(known.position), this.declared);
  }

  /**
   * @param {Store} store
   * @returns {Trace[]}
   */
  traces(store) {
    return [
      ...this.#hypotheses.update(store).map(
        ({ branch, data }) =>
          /** @type {Trace} */ ({
            ...{ kind: "segments", title: "", name: this.id, ink: branch.colour, opacity: data.alpha },
            ...{ x0: data.frame, y0: data.y0, x1: data.x1, y1: data.y1 },
          }),
      ),
      ...this.#truth.update(store).map(({ data }) => this.truth(data)),
    ];
  }

  /** @returns {Limits} */
  limits() {
    const [first, second] = [this.#hypotheses.extent, this.#truth.extent];
    const [low, high] = enclose([Math.min(first[0], second[0]), Math.max(first[1], second[1])], smallestSpan(this.declared.unit));
    return { low, high };
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
  /** @type {Columns} */
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
