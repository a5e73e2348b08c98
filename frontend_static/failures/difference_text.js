/** What a cure changes, in words. */

import { number } from "../shared/format.js";

/** @import { FailurePublic } from "../shared/messages.js" */
/** @import { Value } from "../shared/format.js" */

/**
 * All that a cure changes: "Sharpness lambda 200 to 20".
 *
 * @param {FailurePublic} failure
 */
export function differences(failure) {
  return failure.differences.map(({ title, unit, failing, cured }) => withUnit(`${title} ${value(failing)} to ${value(cured)}`, unit)).join(", ");
}

/**
 * What one of the two runs has of it: "Sharpness lambda 200".
 *
 * @param {FailurePublic} failure
 * @param {"failing"|"cured"} side
 */
export function settings(failure, side) {
  return failure.differences.map((each) => withUnit(`${each.title} ${value(each[side])}`, each.unit)).join(", ");
}

/** @param {Value} given */
export function value(given) {
  if (typeof given === "boolean") return given ? "on" : "off";
  return typeof given === "number" ? number(given, 3).replace(/\.?0+$/, "") : given;
}

/**
 * @param {string} text
 * @param {string} unit
 */
export function withUnit(text, unit) {
  return unit ? `${text} ${unit}` : text;
}
