/** The errors of a failing run and of the cured one over their frames, as a small drawing. */

import { h, svg } from "../shared/dom.js";
import { quantity } from "../shared/format.js";

/** @import { FailureCourse, FailureRun } from "../shared/messages.js" */

const WIDTH = 300;
const HEIGHT = 90;

/**
 * @param {FailureCourse} course
 * @param {number} frame The one before it happens; it is marked.
 */
export function curve({ unit, failing, cured }, frame) {
  const largest = Math.max(largestOf(failing), largestOf(cured)) || 1;
  const last = Math.max(failing.errors.length - 1, 1);
  const x = (/** @type {number} */ at) => (WIDTH * at) / last;
  const path = (/** @type {FailureRun} */ { errors }) => lineOf(errors, x, (error) => HEIGHT - 2 - ((HEIGHT - 4) * error) / largest);
  const words = `Error over ${last + 1} frames. It fails after frame ${frame}: ${errorWords(failing, unit)}. Cured: ${errorWords(cured, unit)}.`;
  return h(
    "figure",
    { class: "curve" },
    svg(
      "svg",
      { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, preserveAspectRatio: "none", role: "img", "aria-label": words },
      svg("path", { class: "stand", d: `M${x(frame)} 0V${HEIGHT}` }),
      svg("path", { class: "cured", d: path(cured) }),
      svg("path", { class: "failing", d: path(failing) }),
    ),
    h(
      "figcaption",
      {},
      h("span", { class: "key failing" }, `fails, up to ${quantity(largestOf(failing), unit)} ${unit}`),
      h("span", { class: "key cured" }, `cured, up to ${quantity(largestOf(cured), unit)} ${unit}`),
    ),
  );
}

/**
 * @param {FailureRun} run
 * @param {string} unit
 */
function errorWords(run, unit) {
  return `up to ${quantity(largestOf(run), unit)} ${unit}, in the end ${quantity(run.errors.at(-1) ?? null, unit)} ${unit}`;
}

/** @param {FailureRun} run */
function largestOf({ errors }) {
  return errors.reduce((/** @type {number} */ most, error) => Math.max(most, error ?? 0), 0);
}

/**
 * @param {(number|null)[]} errors
 * @param {(frame: number) => number} x
 * @param {(error: number) => number} y
 */
function lineOf(errors, x, y) {
  let isDown = false;
  return errors
    .map((error, frame) => {
      const move = isDown ? "L" : "M";
      isDown = error !== null;
      return error === null ? "" : `${move}${x(frame).toFixed(1)} ${y(error).toFixed(1)}`;
    })
    .join("");
}
