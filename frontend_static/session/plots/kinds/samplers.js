/** How many particles came from each sampler, stacked, each frame as wide as it is; of the active branch alone. */

import { h } from "../../../shared/dom.js";
import { number } from "../../../shared/format.js";
import { ofRole, samplers, samplesOf } from "../../series.js";
import { Lines } from "../figure.js";
import { Plot } from "./plot.js";

export class SamplersPlot extends Plot {
  #lines;

  get needs() {
    return ofRole(this.session, "share").map(({ name }) => name);
  }

  heading({ session }) {
    return samplers(session).flatMap(({ name, colour }, place) => (place > 0 ? [" ", key(colour, name)] : [key(colour, name)]));
  }

  reading({ session, history }) {
    return samplesOf(session, history.at(session.position))?.join(" | ") ?? number(null);
  }

  build(Bokeh, frames) {
    super.build(Bokeh, frames);
    const { figure } = this;
    const sources = samplers(this.session);
    const make = (source) => ({
      active: sources.map(({ colour }, place) =>
        figure.area(source, { field: `to ${place}` }, { field: `to ${place + 1}` }, { fill_color: figure.ink[colour] }),
      ),
    });
    this.#lines = new Lines(figure, (history, from) => this.#stairs(history, from, sources.length), make);
  }

  draw(store) {
    super.draw(store);
    this.#lines.draw(store);
    this.figure.range.end = Math.max(1, this.#lines.most);
  }

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

/** A word with the colour that it has in the plot. */
export function key(token, word) {
  const swatch = h("span", { class: "key" });
  swatch.style.background = `var(--${token})`;
  return h("span", {}, swatch, word);
}
