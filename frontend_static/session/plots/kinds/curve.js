/** Kinds that draw one line a branch: error, sigma beside its thresholds, effective sample size. */

import { number, quantity, smallestSpan } from "../../../shared/format.js";
import { curve, isGone } from "../../history.js";
import { numberOf, ofRole, valueOf } from "../../series.js";
import { BranchColumns } from "../branch_columns.js";
import { reach, enclose } from "../limits.js";
import { Shades } from "../shades.js";
import { Plot, columns } from "./plot.js";

/** @import { SessionPublic, ThresholdPublic } from "../../../shared/messages.js" */
/** @import { Curve } from "../../history.js" */
/** @import { Store } from "../../store.js" */
/** @import { Trace } from "../../../shared/figure/traces.js" */
/** @import { Limits } from "./plot.js" */

/** One line a branch: the first of the values, functions of a row. The axis reaches to all of them. */
class CurvePlot extends Plot {
  columns = new BranchColumns((history, from) => columns(history, from, this.values()));

  /** @returns {string[]|null} */
  get needs() {
    return null;
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
    const [first] = Object.keys(this.values());
    return this.columns.update(store).map(({ branch, data, isActive }) =>
      this.line({ name: `${this.id} ${branch.id}`, x: data.frame, y: data[first], ink: branch.colour, width: isActive ? 1.8 : 1.2 }),
    );
  }
}

export class ErrorPlot extends CurvePlot {
  /** @returns {Record<string, Curve>} */
  values() {
    return { error: curve.error };
  }

  heading() {
    return [`${this.declared.title} ${this.session.unit}`.trim()];
  }

  /** @param {Store} store */
  reading({ known, history }) {
    return quantity(curve.error(history.at(known.position)), known.unit);
  }

  shades = [new Shades("hidden", 0.2, (row) => row?.hidden === true), new Shades("lost", 0.16, isGone)];

  /**
   * Behind the curves what runs with other seeds do, where that is known: where most of them are, and the one in the middle.
   *
   * @param {Store} store
   * @returns {Trace[]}
   */
  traces(store) {
    const lines = super.traces(store);
    const { ensemble, known } = store;
    if (!ensemble) return lines;
    const ink = known.branches.find(({ id }) => id === known.branch)?.colour ?? "ink";
    const x = ensemble.middle.map((_, frame) => frame);
    const [low, middle, high] = [ensemble.low, ensemble.middle, ensemble.high].map((values) => values.map((value) => value ?? NaN));
    const band = /** @type {Trace} */ ({ kind: "band", title: "", name: "error of other seeds", ink, opacity: 0.22, x, low, high });
    return [band, this.line({ name: "median of other seeds", x, y: middle, ink, dashed: true, width: 1, said: "median of other seeds" }), ...lines];
  }

  /**
   * @param {Store} store
   * @returns {Limits}
   */
  limits({ known, ensemble }) {
    const others = (ensemble?.high ?? []).filter((value) => value !== null);
    return { low: 0, high: reach(Math.max(smallestSpan(known.unit), this.columns.most, ...others)) };
  }
}

/** One number a frame, which may lie far from 0. */
export class ValuePlot extends CurvePlot {
  get needs() {
    return this.declared.series;
  }

  /** @returns {Record<string, Curve>} */
  values() {
    return { value: (row) => valueOf(row, this.declared.series[0]) };
  }

  /** @param {Store} store */
  reading({ known, history }) {
    return quantity(valueOf(history.at(known.position), this.declared.series[0]), this.declared.unit);
  }

  /** @returns {Limits} */
  limits() {
    const [low, high] = enclose(this.columns.extent, smallestSpan(this.declared.unit, this.columns.most));
    return { low, high };
  }
}

export class SigmaPlot extends CurvePlot {
  /** @returns {Record<string, Curve>} */
  values() {
    return { sigma: curve.sigma };
  }

  /** @param {Store} store */
  heading({ known }) {
    return [`${this.declared.title}${inForce(known).length > 0 ? " | threshold" : ""} ${known.unit}`.trim()];
  }

  /** @param {Store} store */
  reading({ known, history }) {
    const values = [curve.sigma(history.at(known.position)), ...inForce(known)];
    return values.map((value) => quantity(value, known.unit)).join(" | ");
  }

  /**
   * @param {Store} store
   * @returns {Trace[]}
   */
  traces(store) {
    const { x, y } = staircase(limitsOf(store.known), store.known.frames - 1);
    return [...super.traces(store), this.line({ name: "thresholds", x, y, ink: "ink", dashed: true, width: 1.2, said: "threshold" })];
  }

  /**
   * @param {Store} store
   * @returns {Limits}
   */
  limits({ known }) {
    const levels = limitsOf(known).flatMap(({ steps }) => steps.map(({ value }) => value ?? 0));
    return { low: 0, high: reach(Math.max(smallestSpan(known.unit), this.columns.most, ...levels)) };
  }
}

export class SampleSizePlot extends CurvePlot {
  get needs() {
    return ofRole(this.session, "ess").map(({ name }) => name);
  }

  /** @returns {Record<string, Curve>} */
  values() {
    return {
      ess: (row) => numberOf(this.session, "ess", row),
      particles: (row) => numberOf(this.session, "particles", row),
    };
  }

  /** @param {Store} store */
  reading({ known, history }) {
    const row = history.at(known.position);
    const [ess, particles] = [numberOf(known, "ess", row), numberOf(known, "particles", row)];
    return ess === null ? number(null) : `${number(ess, 0)}${particles === null ? "" : ` of ${particles}`}`;
  }

  /** @returns {Limits} */
  limits() {
    return { low: 0, high: reach(Math.max(1, this.columns.most)) };
  }
}

/** How far off the measurements were, beside what they should not be above. */
export class InnovationPlot extends CurvePlot {
  get needs() {
    return ofRole(this.session, "nis").map(({ name }) => name);
  }

  /** @returns {Record<string, Curve>} */
  values() {
    return {
      nis: (row) => numberOf(this.session, "nis", row),
      limit: (row) => numberOf(this.session, "nis_limit", row),
    };
  }

  heading() {
    return [`${this.declared.title} | limit`];
  }

  /** @param {Store} store */
  reading({ known, history }) {
    const row = history.at(known.position);
    const [nis, limit] = [numberOf(known, "nis", row), numberOf(known, "nis_limit", row)];
    return nis === null ? number(null) : `${number(nis, 2)} | ${number(limit, 2)}`;
  }

  /**
   * @param {Store} store
   * @returns {Trace[]}
   */
  traces(store) {
    const lines = super.traces(store);
    const active = this.columns.update(store).find(({ isActive }) => isActive);
    if (!active) return lines;
    const { frame: x, limit: y } = active.data;
    return [this.line({ name: "limit", x, y, ink: "ink", dashed: true, width: 1.2, said: "limit of 95 %" }), ...lines];
  }

  /** @returns {Limits} */
  limits() {
    return { low: 0, high: reach(Math.max(1, this.columns.most)) };
  }
}

/** @param {SessionPublic} session */
function limitsOf(session) {
  return session.thresholds.filter(({ of }) => of === "sigma");
}

/**
 * The thresholds of sigma that are in force in the frame that is shown.
 *
 * @param {SessionPublic} session
 */
function inForce(session) {
  return limitsOf(session)
    .map(({ steps }) => steps.filter(({ frame }) => frame <= session.position).at(-1)?.value)
    .filter((value) => typeof value === "number");
}

/**
 * @param {ThresholdPublic[]} limits
 * @param {number} last The last frame.
 */
function staircase(limits, last) {
  /** @type {{x: number[], y: number[]}} */
  const line = { x: [], y: [] };
  for (const { steps } of limits) {
    steps.forEach(({ frame, value }, index) => {
      line.x.push(frame, steps[index + 1]?.frame ?? last);
      line.y.push(value ?? NaN, value ?? NaN);
    });
    line.x.push(last);
    line.y.push(NaN);
  }
  return line;
}
