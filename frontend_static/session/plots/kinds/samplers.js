/** How many particles came from each sampler, stacked, each frame as wide as it is; of the active branch alone. */

import { h } from "../../../shared/dom.js";
import { number } from "../../../shared/format.js";
import { ofRole, samplers, samplesOf } from "../../series.js";
import { BranchColumns } from "../branch_columns.js";
import { Plot } from "./plot.js";

/** @import { History } from "../../history.js" */
/** @import { Store } from "../../store.js" */
/** @import { Band, Trace } from "../../../shared/figure/traces.js" */
/** @import { Columns } from "../branch_columns.js" */
/** @import { Limits } from "./plot.js" */

export class SamplersPlot extends Plot {
  #columns = new BranchColumns((history, from) => this.#stairs(history, from, samplers(this.session).length), { onlyActive: true });

  get needs() {
    return ofRole(this.session, "share").map(({ name }) => name);
  }

  /** @param {Store} store */
  heading({ known }) {
    return samplers(known).flatMap(({ name, colour }, place) => (place > 0 ? [" ", key(colour, name)] : [key(colour, name)]));
  }

  /** @param {Store} store */
  reading({ known, history }) {
    return samplesOf(known, history.at(known.position))?.join(" | ") ?? number(null);
  }

  /**
   * @param {Store} store
   * @returns {Trace[]}
   */
  traces(store) {
    const sources = samplers(this.session);
    return this.#columns.update(store).flatMap(({ data }) =>
      sources.map(
        ({ colour, name }, place) =>
          /** @type {Band} */ ({
            ...{ kind: "band", title: "", name: `${this.id} ${name}`, ink: colour, opacity: 1 },
            ...{ x: data.frame, low: data[`to ${place}`], high: data[`to ${place + 1}`] },
          }),
      ),
    );
  }

  /** @returns {Limits} */
  limits() {
    return { low: 0, high: Math.max(1, this.#columns.most) };
  }

  /**
   * @param {History} history
   * @param {number} from
   * @param {number} count How many samplers there are.
   */
  #stairs(history, from, count) {
    /** @type {Columns} */
    const data = { frame: [] };
    for (let place = 0; place <= count; place += 1) data[`to ${place}`] = [];
    for (let frame = from; frame < history.length; frame += 1) {
      const samples = samplesOf(this.session, history.at(frame)) ?? [];
      data.frame.push(frame - 0.5, frame + 0.5);
      let sum = 0;
      for (let place = 0; place <= count; place += 1) {
        data[`to ${place}`].push(sum, sum);
        sum += samples[place] ?? 0;
      }
    }
    return data;
  }
}

/**
 * A word with the colour that it has in the plot.
 *
 * @param {string} token
 * @param {string} word
 */
export function key(token, word) {
  const swatch = h("span", { class: "key" });
  swatch.style.background = `var(--${token})`;
  return h("span", {}, swatch, word);
}
