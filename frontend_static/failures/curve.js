/** The errors of a failing run and of the cured one over their frames, in a small figure. */

import { h } from "../shared/dom.js";
import { miniature } from "../shared/figure/miniature.js";
import { quantity } from "../shared/format.js";

/** @import { FailureResult, FailureSide } from "../shared/messages.js" */
/** @import { Axis, Line } from "../shared/figure/traces.js" */

/**
 * @param {FailureResult} course
 * @param {number} frame The one before it happens; it is marked.
 * @param {AbortSignal} signal Takes the figure away.
 */
export function curve({ unit, failing, cured }, frame, signal) {
  const last = Math.max(failing.errors.length - 1, 1);
  const largest = Math.max(largestOf(failing), largestOf(cured)) || 1;
  const traces = [
    { ...line([0, largest]), x: [frame, frame], ink: "muted", width: 1, dashed: true },
    { ...line(cured.errors), ink: "second", width: 2, dashed: true },
    { ...line(failing.errors), ink: "lost", width: 2.5 },
  ];
  const words = `Error over ${last + 1} frames. It fails after frame ${frame}: ${errorWords(failing, unit)}. Cured: ${errorWords(cured, unit)}.`;
  return h(
    "figure",
    { class: "curve" },
    miniature({ x: axis(last), y: axis(largest), traces }, words, signal),
    h(
      "figcaption",
      {},
      h("span", { class: "key failing" }, `fails, up to ${quantity(largestOf(failing), unit)} ${unit}`),
      h("span", { class: "key cured" }, `cured, up to ${quantity(largestOf(cured), unit)} ${unit}`),
    ),
  );
}

/**
 * @param {readonly (number|null)[]} errors A frame each.
 * @returns {Line}
 */
function line(errors) {
  const y = errors.map((error) => error ?? NaN);
  return { kind: "line", title: "", name: "", ink: "", x: [...y.keys()], y, width: 1, said: "", unit: "" };
}

/**
 * @param {number} high
 * @returns {Axis}
 */
function axis(high) {
  return { title: "", unit: "", low: 0, high, log: false, names: [], hidden: true };
}

/**
 * @param {FailureSide} run
 * @param {string} unit
 */
function errorWords(run, unit) {
  return `up to ${quantity(largestOf(run), unit)} ${unit}, in the end ${quantity(run.errors.at(-1) ?? null, unit)} ${unit}`;
}

/** @param {FailureSide} run */
function largestOf({ errors }) {
  return errors.reduce((/** @type {number} */ most, error) => Math.max(most, error ?? 0), 0);
}
