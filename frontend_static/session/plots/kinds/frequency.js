/** How often flags were set up to each frame, in percent, beside how often they should be. */

import { number } from "../../../shared/format.js";
import { frequencies } from "../../series.js";
import { Lines } from "../figure.js";
import { Plot } from "./plot.js";

export class FrequencyPlot extends Plot {
  #lines;
  #levels;

  heading() {
    const { title, levels } = this.declared;
    return [`${title} ${levels.map((level) => number(100 * level, 0)).join(" | ")} %`];
  }

  reading({ session, history }) {
    const shares = this.declared.series.map((name) => number(100 * (frequencies(history, name, session.position).at(-1) ?? NaN), 0));
    return `${shares.join(" | ")} %`;
  }

  build(Bokeh, frames) {
    const { series, levels } = this.declared;
    const percents = levels.map((level) => 100 * level);
    super.build(Bokeh, frames, { ticks: [0, ...percents] });
    this.figure.range.end = 105;
    this.#levels = percents.map((level) => this.figure.level(level));
    const columns = (history, from) => {
      /** @type {Record<string, number[]>} */
      const data = { frame: [] };
      for (const name of series) data[name] = frequencies(history, name).slice(from).map((share) => 100 * share);
      for (let frame = from; frame < history.length; frame += 1) data.frame.push(frame);
      return data;
    };
    const make = (source, branch) => ({
      all: series.map((name) => this.figure.line(source, name, { name: `${this.id} ${branch.id} ${name}` })),
    });
    this.#lines = new Lines(this.figure, columns, make);
  }

  dress(ink, sparkline) {
    super.dress(ink, sparkline);
    for (const level of this.#levels) level.line_color = ink.truth;
  }

  draw(store) {
    super.draw(store);
    this.#lines.draw(store);
  }
}
