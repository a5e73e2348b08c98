/** Kinds that draw where a number lies: within a band of two standard deviations, or between the ends of intervals. */

import { written } from "../../../shared/figure/ticks.js";
import { number, quantity, smallestSpan } from "../../../shared/format.js";
import { isGone } from "../../history.js";
import { valueOf } from "../../series.js";
import { BranchColumns } from "../branch_columns.js";
import { enclose, reach } from "../limits.js";
import { Shades } from "../shades.js";
import { Plot, columns } from "./plot.js";

/** @import { Plot as Declared, SessionPublic } from "../../../shared/messages.js" */
/** @import { Trace } from "../../../shared/figure/traces.js" */
/** @import { Curve, Row } from "../../history.js" */
/** @import { Store } from "../../store.js" */
/** @import { Limits } from "./plot.js" */

/** Areas of the active branch with the truth in them, and lines of all branches. */
class AreaPlot extends Plot {
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
  shades = [new Shades("lost", 0.16, isGone)];
  columns;

  /**
   * @param {Declared} declared
   * @param {SessionPublic} session
   * @param {string[]} limits Columns that the axis reaches to.
   */
  constructor(declared, session, limits) {
    super(declared, session);
    const read = () => ({ ...this.values(), truth: (/** @type {Row|undefined} */ row) => valueOf(row, declared.truth) });
    this.columns = new BranchColumns((history, from) => columns(history, from, read()), { limits });
  }

  /** @returns {Record<string, Curve>} */
  values() {
    return {};
  }

  /**
   * @param {Store} store
   * @returns {Trace[]}
   */
  traces(store) {
    return this.columns.update(store).flatMap(({ branch, data, isActive }) => {
      const { colour: ink } = branch;
      const lines = this.drawn.map(([field, name]) =>
        this.line({ name: `${this.id} ${branch.id}${name}`, x: data.frame, y: data[field], ink, width: isActive ? 1.8 : 1.2 }),
      );
      if (!isActive) return lines;
      const areas = this.areas.map(
        ([low, high], place) =>
          /** @type {Trace} */ ({
            ...{ kind: "band", title: "", name: `${this.id} band ${place}`, ink, opacity: 0.22 },
            ...{ x: data.frame, low: data[low], high: data[high] },
          }),
      );
      return [...areas, this.truth(data), ...lines];
    });
  }
}

/** The axis has 0 in its middle. */
export class BandPlot extends AreaPlot {
  /** @type {[string, string][]} */
  areas = [["low", "high"]];
  /** @type {[string, string][]} */
  drawn = [["value", ""]];

  /**
   * @param {Declared} declared
   * @param {SessionPublic} session
   */
  constructor(declared, session) {
    // The band may be as wide as it likes; the axis follows what is estimated and what is true.
    super(declared, session, ["value", "truth"]);
  }

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

  /** @returns {Limits} */
  limits() {
    const end = reach(Math.max(smallestSpan(this.declared.unit), this.columns.most));
    return { low: -end, high: end, ticks: [-end, 0, end].map((at) => ({ at, text: written(at) })) };
  }
}

export class IntervalPlot extends AreaPlot {
  /**
   * @param {Declared} declared
   * @param {SessionPublic} session
   */
  constructor(declared, session) {
    super(declared, session, ["truth", ...declared.series.flatMap((_, place) => [`low ${place}`, `high ${place}`])]);
    for (const place of declared.series.keys()) this.areas.push([`low ${place}`, `high ${place}`]);
    for (const field of this.areas.flat()) this.drawn.push([field, ` ${field}`]);
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

  /** @returns {Limits} */
  limits() {
    const [low, high] = enclose(this.columns.extent, smallestSpan(this.declared.unit));
    return { low, high };
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
