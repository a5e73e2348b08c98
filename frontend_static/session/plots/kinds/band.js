/** Kinds that draw where a number lies: within a band of two standard deviations, or between the ends of intervals. */

import { number, quantity, smallestSpan } from "../../../shared/format.js";
import { isGone } from "../../history.js";
import { valueOf } from "../../series.js";
import { Lines } from "../figure.js";
import { Plot, columns } from "./plot.js";

const DASHES = [4, 3];

/** Areas of the active branch with the truth in them, and lines of all branches. */
class AreaPlot extends Plot {
  /** @type {Lines} */
  lines;
  /** Columns that the axis reaches to. */
  limits = ["truth"];
  /** Pairs of columns that an area lies between. */
  /** @type {string[][]} */
  areas = [];
  /** Columns that are lines, and what follows the branch in the name of each. */
  /** @type {string[][]} */
  drawn = [];
  /** @type {object} */
  ticks = { desired_num_ticks: 2 };

  /** @returns {Record<string, (row: object) => number>} */
  values() {
    return {};
  }

  build(Bokeh, frames) {
    super.build(Bokeh, frames, this.ticks);
    const values = { ...this.values(), truth: (row) => valueOf(row, this.declared.truth) };
    this.lines = new Lines(this.figure, (history, from) => columns(history, from, values), this.#make, this.limits);
    this.figure.shade("lost", 0.16, isGone);
  }

  #make = (source, branch) => {
    const { figure } = this;
    const truth = { line_color: figure.ink.truth, line_dash: DASHES, line_width: 1.2, tags: ["truth"] };
    const areas = this.areas.map(([low, high]) =>
      figure.area(source, { field: low }, { field: high }, { fill_alpha: 0.22, tags: ["branch"] }),
    );
    return {
      active: [...areas, figure.line(source, "truth", truth)],
      all: this.drawn.map(([field, name]) => figure.line(source, field, { name: `${this.id} ${branch.id}${name}` })),
    };
  };

  dress(ink, sparkline) {
    super.dress(ink, sparkline);
    for (const one of this.lines.ofActive) if (one.tags.includes("truth")) one.glyph.line_color = ink.truth;
  }

  draw(store) {
    super.draw(store);
    this.lines.draw(store);
  }
}

/** The axis has 0 in its middle. */
export class BandPlot extends AreaPlot {
  ticks = { ticks: [0] };
  // The band may be as wide as it likes; the axis follows what is estimated and what is true.
  limits = ["value", "truth"];
  areas = [["low", "high"]];
  drawn = [["value", ""]];

  values() {
    const { series, sd } = this.declared;
    const value = (row) => valueOf(row, series[0]);
    const spread = (row) => valueOf(row, sd);
    return { value, low: (row) => value(row) - 2 * spread(row), high: (row) => value(row) + 2 * spread(row) };
  }

  reading({ session, history }) {
    return withSpread(history.at(session.position), this.declared);
  }

  draw(store) {
    super.draw(store);
    this.figure.reach(Math.max(smallestSpan(this.declared.unit), this.lines.most), { both: true });
  }
}

export class IntervalPlot extends AreaPlot {
  constructor(declared, session) {
    super(declared, session);
    this.areas = declared.series.map((_, place) => [`low ${place}`, `high ${place}`]);
    this.drawn = this.areas.flatMap(([low, high]) => [[low, ` ${low}`], [high, ` ${high}`]]);
    this.limits = ["truth", ...this.areas.flat()];
  }

  values() {
    return Object.fromEntries(
      this.declared.series.flatMap((name, place) => [
        [`low ${place}`, (row) => valueOf(row, name, 0)],
        [`high ${place}`, (row) => valueOf(row, name, 1)],
      ]),
    );
  }

  reading({ session, history }) {
    return between(history.at(session.position), this.declared.series[0], this.declared.unit);
  }

  draw(store) {
    super.draw(store);
    this.figure.enclose(this.lines.extent, smallestSpan(this.declared.unit));
  }
}

/** A number with its standard deviation, if it has one. */
export function withSpread(row, { series: [name], sd, unit }) {
  const value = quantity(valueOf(row, name), unit);
  return value === number(null) || !sd ? value : `${value} ± ${quantity(valueOf(row, sd), unit)}`;
}

/** The ends of an interval. */
export function between(row, name, unit) {
  const [low, high] = [0, 1].map((end) => quantity(valueOf(row, name, end), unit));
  return low === number(null) ? low : `${low} to ${high}`;
}
