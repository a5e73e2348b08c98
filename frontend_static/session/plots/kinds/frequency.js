/** How often flags were set up to each frame, in percent, beside how often they should be. */

import { number } from "../../../shared/format.js";
import { frequencies } from "../../series.js";
import { Lines } from "../lines.js";
import { Plot, made } from "./plot.js";

/** @import { History } from "../../history.js" */
/** @import { Store } from "../../store.js" */
/** @import { BokehApi, Range, Span } from "../bokeh_api.js" */
/** @import { Ink } from "../figure.js" */

export class FrequencyPlot extends Plot {
  /** @type {Lines|null} */
  #lines = null;
  /** @type {Span[]} */
  #levels = [];

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
   * @param {BokehApi} Bokeh
   * @param {Range} frames
   */
  build(Bokeh, frames) {
    const { series, levels } = this.declared;
    const percents = levels.map((level) => 100 * level);
    super.build(Bokeh, frames, { ticks: [0, ...percents] });
    this.figure.range.end = 105;
    this.#levels = percents.map((level) => this.figure.level(level));
    this.#lines = new Lines(
      this.figure,
      (history, from) => percentages(history, from, series),
      (source, branch) => ({ all: series.map((name) => this.figure.line(source, name, { name: `${this.id} ${branch.id} ${name}` })) }),
    );
  }

  /**
   * @param {Ink} ink
   * @param {boolean} sparkline
   */
  dress(ink, sparkline) {
    super.dress(ink, sparkline);
    for (const level of this.#levels) level.line_color = ink.truth;
  }

  /** @param {Store} store */
  draw(store) {
    super.draw(store);
    made(this.#lines).draw(store);
  }
}

/**
 * @param {History} history
 * @param {number} from
 * @param {string[]} series
 */
function percentages(history, from, series) {
  /** @type {Record<string, number[]>} */
  const data = { frame: [] };
  for (const name of series) data[name] = frequencies(history, name).slice(from).map((share) => 100 * share);
  for (let frame = from; frame < history.length; frame += 1) data.frame.push(frame);
  return data;
}
