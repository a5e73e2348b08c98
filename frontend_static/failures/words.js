/** What a cure changes, in words. */

import { parameterValue } from "../shared/format.js";

/** @import { Value } from "../shared/format.js" */
/** @import { FailurePublic } from "../shared/messages.js" */

/**
 * All that a cure changes: "Sharpness lambda 200 to 20".
 *
 * @param {FailurePublic} failure
 */
export function differenceText({ differences: all }) {
  return all.map(({ title, unit, failing, cured }) => `${title} ${value(failing)} to ${value(cured, unit)}`).join(", ");
}

/**
 * What one of the two runs has of it: "Sharpness lambda 200".
 *
 * @param {FailurePublic} failure
 * @param {"failing"|"cured"} side
 */
export function settings(failure, side) {
  return failure.differences.map((each) => `${each.title} ${value(each[side], each.unit)}`).join(", ");
}

/**
 * @param {Value} given
 * @param {string} [unit]
 */
export function value(given, unit = "") {
  const switched = given ? "on" : "off";
  return parameterValue(typeof given === "boolean" ? switched : given, { unit });
}
