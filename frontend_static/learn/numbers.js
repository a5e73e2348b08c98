/** The numbers of a figure: the main one large, each with its exact value and whether it is within the tolerance. */

import { h, html } from "../vendor/preact.js";

/** @import { CheckedPublic, Number as LessonNumber } from "../shared/messages.js" */

const NONE = "–";

/** A number with some significant digits.
 *
 * @param {number|null} value
 * @param {number} digits
 * @param {string} [unit]
 */
export function figure(value, digits, unit = "") {
  if (value === null) return NONE;
  const text = Math.abs(value) >= 10 ** digits ? String(Math.round(value)) : String(Number(value.toPrecision(digits)));
  return unit === "" ? text : `${text} ${unit}`;
}

/**
 * "exact 0.2861, within 0.0106"; unknown parts are left out.
 *
 * @param {Pick<LessonNumber, "exact"|"tolerance"|"digits"|"unit"|"within">} number
 */
export function beside({ exact, tolerance, digits, unit, within }) {
  if (exact === null) return "";
  const known = `exact ${figure(exact, digits, unit)}`;
  if (tolerance === null || within === null) return known;
  return within ? `${known}, within ${figure(tolerance, 2)}` : `${known}, more than ${figure(tolerance, 2)} off`;
}

/**
 * "checked: 0.2825, exact 0.2861, within 0.0106".
 *
 * @param {CheckedPublic} check
 */
export function checked({ ours, exact, tolerance, passed, problem }) {
  if (problem !== null) return problem;
  const [found, known, allowed] = [figure(ours, 4), figure(exact, 4), figure(tolerance, 3)];
  return passed ? `checked: ${found}, exact ${known}, within ${allowed}` : `fails: ${found}, exact ${known}, not within ${allowed}`;
}

/** @param {{within: boolean}} props */
export function Mark({ within }) {
  return html`<span class=${within ? "tick" : "cross"} aria-hidden="true">${within ? " ✓" : " ✗"}</span>`;
}

/** @param {{numbers: readonly LessonNumber[]}} props */
export function Numbers({ numbers }) {
  return numbers.map((number, index) => {
    const { title, value, digits, unit, within } = number;
    return html`<div class=${index === 0 ? "lesson-number first" : "lesson-number"}>
      <output aria-label=${title}>${figure(value, digits, unit)}</output>
      <span class="lesson-number-words">
        <span>${title}</span><span class="hint">${beside(number)}${within !== null && h(Mark, { within })}</span>
      </span>
    </div>`;
  });
}
