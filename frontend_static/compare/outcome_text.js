/** What came of runs beside each other, in words and figures. */

import { number, quantity } from "../shared/format.js";

/** @import { ComparisonResult, Outcome, Paired } from "../shared/messages.js" */

const NONE = "–";
const ERROR = "error";

/** @typedef {{text: string, more?: string, hint?: string}} Cell A figure, what stands below it, and what both say as a sentence. */
/** @typedef {{title: string, hint: string, cells: Cell[]}} Line A line of the table, a cell for each run. */

/**
 * The lines of what came of the runs; those of which nothing is known are left out.
 *
 * @param {ComparisonResult} result
 * @param {{unit: string, names: readonly string[], measure: string}} known `measure` is the title of what decides on success.
 * @returns {Line[]}
 */
export function outcomeLines({ frames, outcomes, paired }, { unit, names, measure }) {
  /**
   * @param {string} title
   * @param {string} hint
   * @param {(outcome: Outcome) => string} text
   */
  const line = (title, hint, text) => ({ title, hint, cells: outcomes.map((outcome) => ({ text: text(outcome) })) });
  const quantities = [...new Set(paired.map(({ name }) => name))];
  return [
    line("Mean error", `Over the ${frames} frames in common`, ({ mean_error }) => withUnit(quantity(mean_error, unit), unit)),
    line(measure, "Share of the frames in common", ({ success_share: share }) => (share === null ? NONE : `${number(100 * share, 0)} %`)),
    line("First lost frame", "The first frame in which the target is lost", lossWords),
    ...quantities.map((name) => pairedLine(paired.filter((each) => each.name === name), names)),
  ].filter(({ cells }) => cells.some(({ text }) => text !== NONE && text !== ""));
}

/** @param {Outcome} outcome */
function lossWords({ lost_frames: lost, first_lost_frame: first }) {
  if (lost === null) return NONE;
  return first === null ? "never" : `${first}`;
}

/**
 * @param {Paired[]} paired Of one quantity.
 * @param {readonly string[]} names
 * @returns {Line}
 */
function pairedLine(paired, names) {
  const [{ title }] = paired;
  const hint = `Mean over the frames in common of a run's value minus that of ${names[0]}, with its 95 % interval`;
  const cells = names.map((_, place) => {
    const found = paired.find(({ second }) => second === place);
    return found === undefined ? { text: "" } : { ...gained(found), hint: sentence(found, names) };
  });
  return { title: `${title}, difference`, hint, cells };
}

/**
 * How far apart, and the interval in which that is known: "+17.1 px" and "10.0 to 24.3".
 *
 * @param {Paired} paired
 * @returns {Cell}
 */
function gained(paired) {
  const { mean, low, high, name, unit } = paired;
  const figure = figureOf(paired);
  const text = mean === null ? NONE : `${mean > 0 ? "+" : ""}${figure(mean)}`;
  return { text: withUnit(text, name === ERROR ? unit : "points"), more: low === null || high === null ? "" : `${figure(low)} to ${figure(high)}` };
}

/**
 * The same as a sentence.
 *
 * @param {Paired} paired
 * @param {readonly string[]} names
 */
export function sentence(paired, names) {
  const { first, second, name, title, unit, frames, mean, low, high } = paired;
  if (mean === null) return `There are no frames in which both runs have a ${title.toLowerCase()}.`;
  const figure = figureOf(paired);
  const amount = withUnit(figure(Math.abs(mean)), name === ERROR ? unit : "percentage points");
  const which = mean === 0 ? "the same as" : `${amount} ${mean > 0 ? "larger" : "smaller"} than`;
  const interval = low === null || high === null ? "" : `, 95 % interval ${figure(low)} to ${figure(high)}`;
  return `${title}: of ${names[second]} on average ${which} of ${names[first]}, over ${frames} frames${interval}.`;
}

/**
 * @param {Paired} paired
 * @returns {(value: number) => string}
 */
function figureOf({ name, unit }) {
  return (value) => (name === ERROR ? quantity(value, unit) : number(100 * value, 0));
}

/**
 * @param {string} text
 * @param {string} unit
 */
function withUnit(text, unit) {
  return text === NONE || unit === "" ? text : `${text} ${unit}`;
}
