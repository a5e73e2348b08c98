/** The changes of a cure in words, and the measurement of both runs. */

import { messageOf, request } from "../shared/api.js";
import { whenCompiled } from "../shared/compiling.js";
import { parameterValue } from "../shared/format.js";

/** @import { Value } from "../shared/format.js" */
/** @import { FailurePublic, FailureResult } from "../shared/messages.js" */
/** @import { Signal } from "../vendor/preact.js" */

/** @typedef {Signal<FailureResult|string|null>} Course The measurement; a sentence in its place; null while unknown. */

/** Load the measurement of both runs once the server has it.
 *
 * @param {FailurePublic} failure
 * @param {Course} course
 * @param {AbortSignal} end No change follows after it.
 */
export async function measure({ experiment, id: failure }, course, end) {
  const ask = () => request("GET failures/{failure}/course", { failure, signal: end });
  try {
    course.value = await whenCompiled(experiment, ask, (sentence) => (course.value = sentence), end);
  } catch (error) {
    if (!end.aborted) course.value = `The measurement is not available: ${messageOf(error)}`;
  }
}

/** All changes of a cure: "Sharpness lambda 200 to 20".
 *
 * @param {FailurePublic} failure
 */
export function differenceText({ differences: all }) {
  return all.map(({ title, unit, failing, cured }) => `${title} ${value(failing)} to ${value(cured, unit)}`).join(", ");
}

/** The changed settings in one of the two runs: "Sharpness lambda 200".
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
