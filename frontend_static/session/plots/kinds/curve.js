/** Kinds that draw one line a branch: error, sigma beside its thresholds, effective sample size. */

import { number, quantity, smallestSpan } from "../../../shared/format.js";
import { curve, isGone } from "../../history.js";
import { numberOf, ofRole } from "../../series.js";
import { Lines } from "../figure.js";
import { Plot, columns } from "./plot.js";

/** One line a branch: the first of the values, functions of a row. The axis reaches to all of them. */
class CurvePlot extends Plot {
  /** @type {Lines} */
  lines;

  /** @returns {string[]|null} */
  get needs() {
    return null;
  }

  /** @returns {Record<string, (row: object) => number|null>} */
  values() {
    return {};
  }

  build(Bokeh, frames) {
    super.build(Bokeh, frames);
    const { figure, id } = this;
    const values = this.values();
    const [first] = Object.keys(values);
    this.lines = new Lines(
      figure,
      (history, from) => columns(history, from, values),
      (source, branch) => ({ all: [figure.line(source, first, { name: `${id} ${branch.id}` })] }),
    );
  }

  draw(store) {
    super.draw(store);
    this.lines.draw(store);
  }
}

export class ErrorPlot extends CurvePlot {
  values() {
    return { error: curve.error };
  }

  heading() {
    return [`${this.declared.title} ${this.session.unit}`.trim()];
  }

  reading({ session, history }) {
    return quantity(curve.error(history.at(session.position)), session.unit);
  }

  build(Bokeh, frames) {
    super.build(Bokeh, frames);
    this.figure.shade("hidden", 0.2, (row) => row?.hidden === true);
    this.figure.shade("lost", 0.16, isGone);
  }

  draw(store) {
    super.draw(store);
    this.figure.reach(Math.max(smallestSpan(store.session.unit), this.lines.most));
  }
}

export class SigmaPlot extends CurvePlot {
  #limits;

  values() {
    return { sigma: curve.sigma };
  }

  heading({ session }) {
    return [`${this.declared.title}${inForce(session).length > 0 ? " | threshold" : ""} ${session.unit}`.trim()];
  }

  reading({ session, history }) {
    const values = [curve.sigma(history.at(session.position)), ...inForce(session)];
    return values.map((value) => quantity(value, session.unit)).join(" | ");
  }

  build(Bokeh, frames) {
    super.build(Bokeh, frames);
    const { figure } = this;
    this.#limits = figure.line(figure.source({ frame: [], value: [] }), "value", { line_dash: "dashed", line_width: 1.2 });
  }

  dress(ink, sparkline) {
    super.dress(ink, sparkline);
    this.#limits.glyph.line_color = ink.ink;
  }

  draw(store) {
    super.draw(store);
    const { session } = store;
    const source = this.#limits.data_source;
    const data = staircase(limitsOf(session), session.frames - 1);
    if (JSON.stringify(data) !== JSON.stringify(source.data)) source.data = data;
    const levels = data.value.filter(Number.isFinite);
    this.figure.reach(Math.max(smallestSpan(session.unit), this.lines.most, ...levels));
  }
}

export class SampleSizePlot extends CurvePlot {
  get needs() {
    return ofRole(this.session, "ess").map(({ name }) => name);
  }

  values() {
    return {
      ess: (row) => numberOf(this.session, "ess", row),
      particles: (row) => numberOf(this.session, "particles", row),
    };
  }

  reading({ session, history }) {
    const row = history.at(session.position);
    const [ess, particles] = ["ess", "particles"].map((role) => numberOf(session, role, row));
    return ess === null ? number(null) : `${number(ess, 0)}${particles === null ? "" : ` of ${particles}`}`;
  }

  draw(store) {
    super.draw(store);
    this.figure.reach(Math.max(1, this.lines.most));
  }
}

function limitsOf(session) {
  return session.thresholds.filter(({ of }) => of === "sigma");
}

/** The thresholds of sigma that are in force in the frame that is shown. */
function inForce(session) {
  return limitsOf(session)
    .map(({ steps }) => steps.filter(({ frame }) => frame <= session.position).at(-1)?.value)
    .filter((value) => typeof value === "number");
}

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
