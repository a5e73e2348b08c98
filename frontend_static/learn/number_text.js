/** What is said of numbers, checks and progress. */

/** @import { CheckedPublic, Number as LessonNumber } from "../shared/messages.js" */
/** @import { Entry } from "./progress.js" */

const NONE = "–";
const STANDING = { open: "not answered yet", skipped: "viewed without an answer", right: "answered rightly", wrong: "answered, but wrong" };

/**
 * A number with so many digits that count.
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
 * "exact 0.2861, within 0.0106"; what is not known is left out.
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

/**
 * @param {Entry|null} entry
 * @returns {"open"|"skipped"|"right"|"wrong"}
 */
export function stateOf(entry) {
  if (entry === null) return "open";
  if ("skipped" in entry) return "skipped";
  return entry.right ? "right" : "wrong";
}

/**
 * How a lesson stands, in a few words.
 *
 * @param {Entry|null} entry
 */
export function standing(entry) {
  return STANDING[stateOf(entry)];
}
