/** Kinds that draw where a number lies: within a band of two standard deviations, or between the ends of intervals. */

import { number, quantity, smallestSpan } from "../../../shared/format.js";
import { isGone } from "../../history.js";
import { valueOf } from "../../series.js";
import { Lines } from "../lines.js";
import { Plot, columns, made } from "./plot.js";

/** @import { BranchPublic, Plot as Declared, SessionPublic } from "../../../shared/messages.js" */
/** @import { Curve, Row } from "../../history.js" */
/** @import { Store } from "../../store.js" */
/** @import { BokehApi, Range, Source } from "../bokeh_api.js" */
/** @import { Ink, Ticks } from "../figure.js" */
/** @import { Glyphs } from "../lines.js" */

const DASHES = [4, 3];

/** Areas of the active branch with the truth in them, and lines of all branches. */
class AreaPlot extends Plot {
  /** @type {Lines|null} */
  #lines = null;
  /** Columns that the axis reaches to. */
  limits = ["truth"];
  /**
   * Pairs of columns that an area lies between.
   *
   * @type {[low: string, high: string][]}
   */
  areas = [];
  /**
   * Columns that are lines, and what follows the branch in the name of each.
   *
   * @type {[field: string, name: string][]}
   */
  drawn = [];
  /** @type {Ticks} */
  ticks = { desired_num_ticks: 2 };

  /** The lines, once they are made. */
  get lines() {
    return made(this.#lines);
  }

  /** @returns {Record<string, Curve>} */
  values() {
    return {};
  }

  /**
   * @param {BokehApi} Bokeh
   * @param {Range} frames
   */
  build(Bokeh, frames) {
    super.build(Bokeh, frames, this.ticks);
    /** @type {Record<string, Curve>} */
    const values = { ...this.values(), truth: (row) => valueOf(row, this.declared.truth) };
    this.#lines = new Lines(this.figure, (history, from) => columns(history, from, values), (source, branch) => this.#make(source, branch), this.limits);
    this.figure.shade("lost", 0.16, isGone);
  }

  /**
   * @param {Source} source
   * @param {BranchPublic} branch
   * @returns {Glyphs}
   */
  #make(source, branch) {
    const { figure } = this;
    const truth = { line_color: figure.ink.truth, line_dash: DASHES, line_width: 1.2, tags: ["truth"] };
    const areas = this.areas.map(([low, high]) =>
      figure.area(source, low, high, { fill_alpha: 0.22, tags: ["branch"] }),
    );
    return {
      active: [...areas, figure.line(source, "truth", truth)],
      all: this.drawn.map(([field, name]) => figure.line(source, field, { name: `${this.id} ${branch.id}${name}` })),
    };
  }

  /**
   * @param {Ink} ink
   * @param {boolean} sparkline
   */
  dress(ink, sparkline) {
    super.dress(ink, sparkline);
    for (const one of this.lines.ofActive) if (one.tags.includes("truth")) one.glyph.line_color = ink.truth;
  }

  /** @param {Store} store */
  draw(store) {
    super.draw(store);
    this.lines.draw(store);
  }
}

/** The axis has 0 in its middle. */
export class BandPlot extends AreaPlot {
  /** @type {Ticks} */
  ticks = { ticks: [0] };
  // The band may be as wide as it likes; the axis follows what is estimated and what is true.
  limits = ["value", "truth"];
  /** @type {[string, string][]} */
  areas = [["low", "high"]];
  /** @type {[string, string][]} */
  drawn = [["value", ""]];

  /** @returns {Record<string, Curve>} */
  values() {
    const { series, sd } = this.declared;
    const value = (/** @type {Row|undefined} */ row) => valueOf(row, series[0]);
    const spread = (/** @type {Row|undefined} */ row) => valueOf(row, sd);
    return { value, low: (row) => value(row) - 2 * spread(row), high: (row) => value(row) + 2 * spread(row) };
  }

  /** @param {Store} store */
  reading({ known, history }) {
    return withSpread(history.at(known.position), this.declared);
  }

  /** @param {Store} store */
  draw(store) {
    super.draw(store);
    this.figure.reach(Math.max(smallestSpan(this.declared.unit), this.lines.most), { both: true });
  }
}

export class IntervalPlot extends AreaPlot {
  /**
   * @param {Declared} declared
   * @param {SessionPublic} session
   */
  constructor(declared, session) {
    super(declared, session);
    for (const place of declared.series.keys()) this.areas.push([`low ${place}`, `high ${place}`]);
    for (const field of this.areas.flat()) this.drawn.push([field, ` ${field}`]);
    this.limits = ["truth", ...this.areas.flat()];
  }

  /** @returns {Record<string, Curve>} */
  values() {
    /** @type {Record<string, Curve>} */
    const values = {};
    this.declared.series.forEach((name, place) => {
      values[`low ${place}`] = (row) => valueOf(row, name, 0);
      values[`high ${place}`] = (row) => valueOf(row, name, 1);
    });
    return values;
  }

  /** @param {Store} store */
  reading({ known, history }) {
    return between(history.at(known.position), this.declared.series[0], this.declared.unit);
  }

  /** @param {Store} store */
  draw(store) {
    super.draw(store);
    this.figure.enclose(this.lines.extent, smallestSpan(this.declared.unit));
  }
}

/**
 * A number with its standard deviation, if it has one.
 *
 * @param {Row|undefined} row
 * @param {Pick<Declared, "series"|"sd"|"unit">} declared
 */
export function withSpread(row, { series: [name], sd, unit }) {
  const value = quantity(valueOf(row, name), unit);
  return value === number(null) || !sd ? value : `${value} ± ${quantity(valueOf(row, sd), unit)}`;
}

/**
 * The ends of an interval.
 *
 * @param {Row|undefined} row
 * @param {string} name
 * @param {string} unit
 */
export function between(row, name, unit) {
  const [low, high] = [0, 1].map((end) => quantity(valueOf(row, name, end), unit));
  return low === number(null) ? low : `${low} to ${high}`;
}
