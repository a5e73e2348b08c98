/** The differences between runs, only those, and their results, in words and figures. */

import { count, number, quantity } from "../shared/format.js";
import { h, html } from "../vendor/preact.js";

/** @import { ComparisonResult, Outcome as RunOutcome, Paired, Setting } from "../shared/messages.js" */
/** @import { Outcome, Outline } from "./compare.js" */

const INTERVAL =
  "An error that is large in one frame is large in the next: the frames of one run are not independent trials. Therefore the frames in " +
  "common are divided into six blocks, and the interval is that of the block means (batch means). It holds for these runs with " +
  "these seeds; for other seeds, run a sweep.";
const NONE = "–";
const ERROR = "error";

/** @param {{outline: Outline, outcome: Outcome|null, measure: string}} props `measure` is the title of the success measure. */
export function Table({ outline: { runs, settings, unit }, outcome, measure }) {
  const result = measure === "" ? null : (outcome?.result ?? null);
  const lines = result ? outcomeLines(result, { unit, names: runs.map(({ name }) => name), measure }) : [];
  const isShort = runs.length > 2;
  return html`<section class="comparison-table" aria-label="What differs">
    <table>
      <thead><tr><td></td>${runs.map(({ name, colour }, place) => html`<th scope="col" title=${name} aria-label=${name}>
        <span class="swatch" style=${{ background: colour }}></span><span aria-hidden="true">${place + 1}</span>
      </th>`)}</tr></thead>
      <tbody>${settings.map((setting) => h(SettingRow, { setting, isShort }))}</tbody>
      <tbody>${lines.map(({ title, hint, cells }) => html`<tr>
        <th scope="row" title=${hint}>${title}</th>
        ${cells.map(({ text, more }) => html`<td class="figure">${text}${more && html`<span class="hint">${more}</span>`}</td>`)}
      </tr>`)}</tbody>
    </table>
    ${result && lines.length > 0 && html`<p class="hint over">Over all ${count(result.frames, "frame")} in common.</p>`}
    ${settings.length === 0 && html`<p class="hint">The runs have identical settings.</p>`}
    ${outcome && html`<p class=${outcome.state === "failed" ? "hint wrong" : "hint"} role="status">${progressWords(outcome)}</p>`}
    ${result?.paired.some(({ low }) => low !== null) && html`<details class="hint"><summary>What the interval means</summary><p>${INTERVAL}</p></details>`}
  </section>`;
}

/** @param {{setting: Setting, isShort: boolean}} props `isShort` if there is little room: a name has a short form in brackets. */
function SettingRow({ setting: { name, title, values }, isShort }) {
  const words = (/** @type {string} */ value) => (isShort && name === "tracker" ? value.replaceAll(/[^,(]*\(([^)]+)\)/g, "$1") : value);
  return html`<tr data-setting=${name}>
    <th scope="row">${title}</th>
    ${values.map((value) => (value === null ? html`<td title="This run has no such setting">–</td>` : html`<td title=${value}>${words(value)}</td>`))}
  </tr>`;
}

/** @param {Outcome} outcome */
function progressWords({ state, done, total, error }) {
  if (state === "done") return null;
  if (state === "failed") return `The results are not available: ${error}`;
  if (total === 0) return "The results are computed as soon as the server has a free place";
  return `Computing the results, ${done} of ${count(total, "frame")}`;
}

/** @typedef {{text: string, more?: string}} Cell A figure, and a note below it. */
/** @typedef {{title: string, hint: string, cells: Cell[]}} Line A line of the table, one cell per run. */

/** The lines of the results; lines without a value are left out.
 *
 * @param {ComparisonResult} result
 * @param {{unit: string, names: readonly string[], measure: string}} known `measure` is the title of the success measure.
 * @returns {Line[]}
 */
export function outcomeLines({ frames, outcomes, paired }, { unit, names, measure }) {
  /**
   * @param {string} title
   * @param {string} hint
   * @param {(outcome: RunOutcome) => string} text
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

/** @param {RunOutcome} outcome */
function lossWords({ lost_frames: lost, first_lost_frame: first }) {
  if (lost === null) return NONE;
  return first === null ? "never" : `${first}`;
}

/** @param {Paired[]} paired Differences in one quantity.
 * @param {readonly string[]} names
 * @returns {Line}
 */
function pairedLine(paired, names) {
  const [{ title }] = paired;
  const hint = `Mean over the frames in common of a run's value minus that of ${names[0]}, with its 95 % interval`;
  const cells = names.map((_, place) => {
    const found = paired.find(({ second }) => second === place);
    return found === undefined ? { text: "" } : gained(found);
  });
  return { title: `${title}, difference`, hint, cells };
}

/** A difference and its interval: "+17.1 px" and "10.0 to 24.3".
 *
 * @param {Paired} paired
 * @returns {Cell}
 */
function gained({ mean, low, high, name, unit }) {
  const isError = name === ERROR;
  const figure = (/** @type {number} */ value) => (isError ? quantity(value, unit) : number(100 * value, 0));
  const text = mean === null ? NONE : `${mean > 0 ? "+" : ""}${figure(mean)}`;
  return { text: withUnit(text, isError ? unit : "points"), more: low === null || high === null ? "" : `${figure(low)} to ${figure(high)}` };
}

/**
 * @param {string} text
 * @param {string} unit
 */
function withUnit(text, unit) {
  return text === NONE || unit === "" ? text : `${text} ${unit}`;
}
