/** How often flags were set up to each frame, in percent, beside how often they should be. */

import { number } from "../../../shared/format.js";
import { frequencies } from "../../series.js";
import { BranchColumns } from "../branch_columns.js";
import { Plot } from "./plot.js";

/** @import { Trace } from "../../../shared/figure/traces.js" */
/** @import { History } from "../../history.js" */
/** @import { Store } from "../../store.js" */
/** @import { Columns } from "../branch_columns.js" */
/** @import { Limits } from "./plot.js" */

/** Room above all, so that the line of all is seen. */
const HIGHEST = 105;

export class FrequencyPlot extends Plot {
  #columns = new BranchColumns((history, from) => percentages(history, from, this.declared.series));

  heading() {
    const { title, levels } = this.declared;
    return [`${title} ${levels.map((level) => number(100 * level, 0)).join(" | ")} %`];
  }

  /** @param {Store} store */
  reading({ known, history }) {
    const shares = this.declared.series.map((name) => number(100 * (frequencies(history, name, known.position).at(-1) ?? NaN), 0));
    return `${shares.join(" | ")} %`;
  }

  /**
   * @param {Store} store
   * @returns {Trace[]}
   */
  traces(store) {
    const { frames } = store.known;
    const levels = this.#levels.map((level) =>
      this.line({ name: `level ${level}`, x: [0, frames], y: [level, level], ink: "truth", dashed: true, width: 1, said: "expected" }),
    );
    const lines = this.#columns.update(store).flatMap(({ branch, data, isActive }) =>
      this.declared.series.map((name) =>
        this.line({ name: `${this.id} ${branch.id} ${name}`, x: data.frame, y: data[name], ink: branch.colour, width: isActive ? 1.8 : 1.2 }),
      ),
    );
    return [...levels, ...lines];
  }

  /** @returns {Limits} */
  limits() {
    return { low: 0, high: HIGHEST, ticks: [0, ...this.#levels].map((at) => ({ at, text: number(at, 0) })) };
  }

  get #levels() {
    return this.declared.levels.map((level) => 100 * level);
  }
}

/**
 * @param {History} history
 * @param {number} from
 * @param {string[]} series
 */
function percentages(history, from, series) {
  /** @type {Columns} */
  const data = { frame: [] };
  for (const name of series) data[name] = frequencies(history, name).slice(from).map((share) => 100 * share);
  for (let frame = from; frame < history.length; frame += 1) data.frame.push(frame);
  return data;
}
