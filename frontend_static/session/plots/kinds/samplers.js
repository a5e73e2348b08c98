/** How many particles came from each sampler, stacked, each frame as wide as it is; of the active branch alone. */

import { h } from "../../../shared/dom.js";
import { number } from "../../../shared/format.js";
import { ofRole, samplers, samplesOf } from "../../series.js";
import { Lines } from "../lines.js";
import { Plot, made } from "./plot.js";

/** @import { History } from "../../history.js" */
/** @import { Store } from "../../store.js" */
/** @import { BokehApi, Range } from "../bokeh_api.js" */

export class SamplersPlot extends Plot {
  /** @type {Lines|null} */
  #lines = null;

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
   * @param {BokehApi} Bokeh
   * @param {Range} frames
   */
  build(Bokeh, frames) {
    super.build(Bokeh, frames);
    const { figure } = this;
    const sources = samplers(this.session);
    this.#lines = new Lines(
      figure,
      (history, from) => this.#stairs(history, from, sources.length),
      (source) => ({
        active: sources.map(({ colour }, place) => figure.area(source, `to ${place}`, `to ${place + 1}`, { fill_color: figure.ink[colour] })),
      }),
    );
  }

  /** @param {Store} store */
  draw(store) {
    super.draw(store);
    const lines = made(this.#lines);
    lines.draw(store);
    this.figure.range.end = Math.max(1, lines.most);
  }

  /**
   * @param {History} history
   * @param {number} from
   * @param {number} count How many samplers there are.
   */
  #stairs(history, from, count) {
    /** @type {Record<string, number[]>} */
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
