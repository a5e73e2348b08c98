/** Kinds that draw one line a branch: error, sigma beside its thresholds, effective sample size. */

import { number, quantity, smallestSpan } from "../../../shared/format.js";
import { curve, isGone } from "../../history.js";
import { numberOf, ofRole, valueOf } from "../../series.js";
import { Lines } from "../lines.js";
import { Plot, columns, made } from "./plot.js";

/** @import { SessionPublic, ThresholdPublic } from "../../../shared/messages.js" */
/** @import { Curve } from "../../history.js" */
/** @import { Store } from "../../store.js" */
/** @import { BokehApi, Range, Renderer } from "../bokeh_api.js" */
/** @import { Ink } from "../figure.js" */

/** One line a branch: the first of the values, functions of a row. The axis reaches to all of them. */
class CurvePlot extends Plot {
  /** @type {Lines|null} */
  #lines = null;

  /** The lines, once they are made. */
  get lines() {
    return made(this.#lines);
  }

  /** @returns {string[]|null} */
  get needs() {
    return null;
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
    super.build(Bokeh, frames);
    const { figure, id } = this;
    const values = this.values();
    const [first] = Object.keys(values);
    this.#lines = new Lines(
      figure,
      (history, from) => columns(history, from, values),
      (source, branch) => ({ all: [figure.line(source, first, { name: `${id} ${branch.id}` })] }),
    );
  }

  /** @param {Store} store */
  draw(store) {
    super.draw(store);
    this.lines.draw(store);
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

  /**
   * @param {BokehApi} Bokeh
   * @param {Range} frames
   */
  build(Bokeh, frames) {
    super.build(Bokeh, frames);
    this.figure.shade("hidden", 0.2, (row) => row?.hidden === true);
    this.figure.shade("lost", 0.16, isGone);
  }

  /** @param {Store} store */
  draw(store) {
    super.draw(store);
    this.figure.reach(Math.max(smallestSpan(store.known.unit), this.lines.most));
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

  /** @param {Store} store */
  draw(store) {
    super.draw(store);
    this.figure.enclose(this.lines.extent, smallestSpan(this.declared.unit, this.lines.most));
  }
}

export class SigmaPlot extends CurvePlot {
  /** @type {Renderer|null} */
  #limits = null;

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
   * @param {BokehApi} Bokeh
   * @param {Range} frames
   */
  build(Bokeh, frames) {
    super.build(Bokeh, frames);
    const { figure } = this;
    this.#limits = figure.line(figure.source({ frame: [], value: [] }), "value", { line_dash: "dashed", line_width: 1.2 });
  }

  /**
   * @param {Ink} ink
   * @param {boolean} sparkline
   */
  dress(ink, sparkline) {
    super.dress(ink, sparkline);
    made(this.#limits).glyph.line_color = ink.ink;
  }

  /** @param {Store} store */
  draw(store) {
    super.draw(store);
    const { known } = store;
    const source = made(this.#limits).data_source;
    const data = staircase(limitsOf(known), known.frames - 1);
    if (JSON.stringify(data) !== JSON.stringify(source.data)) source.data = data;
    const levels = data.value.filter(Number.isFinite);
    this.figure.reach(Math.max(smallestSpan(known.unit), this.lines.most, ...levels));
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

  /** @param {Store} store */
  draw(store) {
    super.draw(store);
    this.figure.reach(Math.max(1, this.lines.most));
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
  /** @type {Record<string, number[]>} */
  const data = { frame: [], value: [] };
  for (const { steps } of limits) {
    steps.forEach(({ frame, value }, index) => {
      data.frame.push(frame, steps[index + 1]?.frame ?? last);
      data.value.push(value ?? NaN, value ?? NaN);
    });
    data.frame.push(last);
    data.value.push(NaN);
  }
  return data;
}
