/** The page of a sweep: its progress, its maps, and the runs of the chosen cell, failures first. */

import { trackerTitle } from "../session/steering.js";
import { addressOf, request, START } from "../shared/api.js";
import { linkToReferences } from "../shared/comparison.js";
import { confirmLoss } from "../shared/dialog.js";
import { attempt, IconButton, lastOfAddress, Notice, part, Popover, Segments, Select, setText } from "../shared/dom.js";
import { CodeButton } from "../shared/exports.js";
import { count, duration, parameterValue } from "../shared/format.js";
import { Loaded, showPage } from "../shared/page.js";
import { PresentationButton } from "../shared/presentation.js";
import { newSweep } from "../shared/share_link.js";
import { Explained } from "../shared/terms.js";
import { effect, h, html, useSignal } from "../vendor/preact.js";
import { Maps, placeOf, shortOf } from "./maps.js";
import { begin, chosen, gone, isLost, look, newest, NO_AXIS, quantitiesOf, runPage, seen, short } from "./store.js";

/** @import { RowPublic, RowsPublic, SweepPublic } from "../shared/messages.js" */
/** @import { Chosen, Seen, View } from "./store.js" */

/** @typedef {(offset: number) => Promise<RowsPublic>} Ask */

const ROWS = 50;
const BONES = [html`<div class="bone shimmer"></div>`, html`<div class="bone short shimmer"></div>`];
const MOST_BESIDE = 3;
const ALL = "";
const INVITATION = "Choose a cell of a map to list its runs here, failures first. A run opens in a new tab, shortly before it lost the target.";
const FORMATS = [
  ["parquet", "All runs, Parquet"],
  ["csv", "All runs, CSV"],
  ["html", "Report, one HTML page"],
  ["png", "Maps, PNG in an archive"],
  ["svg", "Maps, SVG in an archive"],
];
const DOWNLOAD = { icon: /** @type {const} */ ("save"), label: "Download", words: "Download", title: "Download runs, report or maps" };
const SINGLE = [
  { value: "success", words: "Success", hint: "Share of the runs that succeeded" },
  { value: "error", words: "Error", hint: "Mean error of the successful runs" },
  { value: "measure", words: "Measure", hint: "Mean of a benchmark measure over all runs" },
];
const COMPARED = [
  { value: "difference", words: "Difference", hint: "One tracker's rate, error or measure minus another's" },
  { value: "significance", words: "Significance", hint: "Cells where two trackers differ on the same scenes (McNemar's test of success, else signed ranks)" },
];
const LEVELS = ["0.05", "0.01", "0.001"].map((value) => ({ value, words: `${100 * Number(value)} %` }));

/** The whole page. */
function Page() {
  const [now, cell] = [seen.value, chosen.value];
  if (gone.value !== null) {
    const action = { label: "Back to the experiments", href: START };
    return html`<div class="sweep-wait">${h(Notice, { title: "Couldn't show this sweep", message: gone.value, action, inline: false })}</div>`;
  }
  return html`
    <div class="bar-lost" data-part="disconnected" role="status" hidden=${!isLost.value}>Reconnecting</div>
    <section class="sweep-main">
      <div class="sweep-bar" role="group" aria-label="Progress">${now && h(Bar, { sweep: now.sweep })}</div>
      <div class="sweep-choices" role="group" aria-label="Content of the maps">${now && h(Choices, { now })}</div>
      ${now ? h(Maps, { now }) : html`<div class="maps late">${[0, 1, 2].map(() => html`<div class="map-bone shimmer"></div>`)}</div>`}
      ${now && h(Facts, { now })}
    </section>
    <aside class="sweep-side" data-part="runs" aria-label="Runs of the chosen cell">
      ${now && (cell === null ? html`<h2>Runs</h2><p class="hint">${INVITATION}</p>` : h(Runs, { key: cell.nth, now, cell }))}
    </aside>
  `;
}

/** The progress of the sweep, and its buttons.
 *
 * @param {{sweep: SweepPublic}} props
 */
function Bar({ sweep }) {
  const { id, done, runs, state, message, experiment, trials, frames, seed, parameters, loss_probability } = sweep;
  const act = (/** @type {"POST sweeps/{sweep}/cancel"|"POST sweeps/{sweep}/resume"} */ route) => async () =>
    (newest.value = (await attempt(() => request(route, { sweep: id }))) ?? newest.value);
  const files = FORMATS.map(([format, words]) =>
    html`<li><a class="button quiet grow" href=${addressOf("GET sweeps/{sweep}/download", { sweep: id, format })} download="">${words}</a></li>`,
  );
  const axes = sweep.axes.map(({ name, values }) => ({ name, values }));
  const again = { experiment, axes, trackers: sweep.trackers.map((tracker) => tracker.id), trials, frames, seed, parameters, loss_probability };
  return html`
    <div class="bar-line">
      <div class="bar-grow">
        <progress max="1" value=${done / runs} aria-label="Runs done" hidden=${state === "done"}></progress>
        <p class="bar-words" role="status">${progress(sweep)}</p>
      </div>
      <div class="row-actions">
        ${state === "running" && html`<button type="button" data-role="cancel" onClick=${act("POST sweeps/{sweep}/cancel")}>Cancel</button>`}
        ${state === "stopped" && html`<button type="button" class="primary" data-role="resume" onClick=${act("POST sweeps/{sweep}/resume")}>Resume</button>`}
        ${done > 0 && h(Popover, { ...DOWNLOAD, content: html`<ul class="menu-list">${files}</ul>` })}
        ${!sweep.recording && html`<a class="button" href=${newSweep(again)} title="Fill the form with this plan">Change and repeat</a>`}
        ${h(IconButton, { name: "trash", title: "Delete this sweep", run: () => remove(sweep) })}
      </div>
    </div>
    ${state === "stopped" && message && html`<p class="note">${message}</p>`}
  `;
}

/** @param {SweepPublic} sweep */
function progress({ state, runs, done, rate, seconds, seconds_left }) {
  const all = count(runs, "run");
  if (state === "done") return html`<strong>Complete</strong>, ${all} in ${duration(seconds)}`;
  const some = `${done.toLocaleString("en-GB")} of ${all}`;
  if (state === "stopped") return html`<strong>Stopped</strong> after ${some}`;
  if (rate === null) return html`<strong>${done === 0 ? "Starting" : "Running"}</strong>, ${some}`;
  const speed = rate >= 10 ? Math.round(rate).toLocaleString("en-GB") : rate.toFixed(1);
  return html`<strong>${some}</strong>, ${speed} runs/s, about ${duration(seconds_left)} left`;
}

/** @param {SweepPublic} sweep */
async function remove({ id, title, done }) {
  const text = `${title} and its ${count(done, "run")} are deleted permanently, unless you downloaded them.`;
  const deleted = () => request("DELETE sweeps/{sweep}", { sweep: id }).then(() => location.assign(START));
  if (await confirmLoss({ title: "Delete this sweep?", text, action: "Delete it" })) await attempt(deleted);
}

/** The quantity, the axes, and the two compared trackers.
 *
 * @param {{now: Seen}} props
 */
function Choices({ now }) {
  const { sweep, view, quantity, compares } = now;
  const quantities = quantitiesOf(sweep);
  const measures = sweep.measures.map(({ name, title }) => ({ value: name, words: title }));
  const single = SINGLE.filter(({ value }) => (value === "measure" ? measures.length > 0 : quantities.some(({ name }) => name === value)));
  const shows = [...single, ...(sweep.trackers.length > 1 ? COMPARED : [])];
  const shown = quantity.measure ? "measure" : quantity.name;
  const choose = (/** @type {string} */ show) => {
    if (COMPARED.some(({ value }) => value === show)) look({ show });
    else look({ show: "values", of: show === "measure" ? (quantity.measure?.name ?? measures[0].value) : show });
  };
  const of = (/** @type {string} */ name) => look({ of: name });
  return html`
    ${h(Segments, { label: "Quantity", options: shows, value: compares ? view.show : shown, choose })}
    ${!compares && quantity.measure && html`<span class="choice" title=${quantity.measure.description}>
      ${h(Select, { label: "Which measure", options: measures, value: view.of, choose: of })}
    </span>`}
    ${sweep.axes.length > 1 && h(Axes, { now })}
    ${compares && html`<span class="choice versus">
      ${h(Pair, { now })}
      ${quantities.length > 1 && html`<span title=${quantity.measure?.description}>
        ${" by "}${h(Select, { label: "Compared by", options: quantities.map(({ name, words }) => ({ value: name, words })), value: view.of, choose: of })}
      </span>`}
      ${view.show === "significance" && h(Significance, { view })}
    </span>`}
  `;
}

/** @param {{now: Seen}} props */
function Axes({ now: { sweep, view } }) {
  const across = sweep.axes.map(({ name, title }) => ({ value: name, words: title }));
  const up = [...across, { value: NO_AXIS, words: "none" }];
  return html`<span class="choice end">
    <span class="pair">across${h(Select, { label: "Axis across", options: across, value: view.x, choose: eitherOf(view, "x", "y") })}</span>
    <span class="pair">up${h(Select, { label: "Axis up", options: up, value: view.y, choose: eitherOf(view, "y", "x") })}</span>
  </span>`;
}

/** @param {{now: Seen}} props */
function Pair({ now: { sweep, view } }) {
  const trackers = sweep.trackers.map(({ id }) => ({ value: id, words: shortOf(sweep, id) }));
  return html`
    ${h(Select, { label: "First tracker", options: trackers, value: view.first, choose: eitherOf(view, "first", "second") })}
    ${" against "}
    ${h(Select, { label: "Second tracker", options: trackers, value: view.second, choose: eitherOf(view, "second", "first") })}
  `;
}

/** Choosing the other tracker's value swaps the two.
 *
 * @param {View} view
 * @param {keyof View} one
 * @param {keyof View} other
 */
function eitherOf(view, one, other) {
  return (/** @type {string} */ value) => look({ [one]: value, [other]: value === view[other] ? view[one] : view[other] });
}

/** @param {{view: View}} props */
function Significance({ view }) {
  const isHolm = view.correction === "holm";
  return html`
    ${h(Select, { label: "Level", options: LEVELS, value: view.level, choose: (level) => look({ level }) })}
    <label class="check" title="Holm's correction: the level holds for the whole map, not for each single cell">
      <input type="checkbox" checked=${isHolm} onChange=${() => look({ correction: isHolm ? "none" : "holm" })} />Holm
    </label>
  `;
}

/** @param {{now: Seen}} props The settings of all runs. */
function Facts({ now: { sweep, view } }) {
  const { trials, frames, seed, experiment } = sweep;
  const fixed = sweep.fixed.map(({ title, values: [value], ...declaration }) => `${title.toLowerCase()} ${parameterValue(value, declaration)}`);
  const unseen = sweep.axes.filter(({ name }) => name !== view.x && name !== view.y);
  const pooled = unseen.map(({ title, values }) => `${values.length} values of ${title.toLowerCase()}`);
  const parts = [`${count(trials, "trial")} of ${frames} frames`, `seed ${seed}`, ...fixed];
  if (pooled.length > 0) parts.push(`pooled over ${pooled.join(" and ")}`);
  const words = `${parts.join(", ")}. All trackers meet the same seeds. Intervals are Wilson's, 95\u00a0%.`;
  return html`<p class="hint">${h(Explained, { text: words, experiment })}</p>`;
}

/** @param {{now: Seen, cell: Chosen}} props */
function Runs({ now, cell: { i, j, tracker: first } }) {
  const { sweep, cells: { x, y }, view } = now;
  const tracker = useSignal(first ?? ALL);
  const trackers = [{ value: ALL, words: "All trackers" }, ...sweep.trackers.map(({ id, title }) => ({ value: id, words: title }))];
  const where = { sweep: sweep.id, x: view.x, y: view.y, i, j, limit: ROWS };
  const ask = (/** @type {number} */ offset) =>
    request("GET sweeps/{sweep}/rows", { ...where, offset, tracker: tracker.value === ALL ? null : tracker.value });
  const load = async () => h(List, { now, found: await ask(0), ask });
  return html`
    <header class="runs-head">
      <h2>${placeOf(x, i)}${y && [html`<br />`, placeOf(y, j)]}</h2>
      ${trackers.length > 2 && h(Select, { label: "Tracker", options: trackers, value: tracker.value, choose: (id) => (tracker.value = id) })}
    </header>
    ${h(Loaded, { key: tracker.value, load, failed: "Couldn't load these runs", bones: BONES })}
  `;
}

/**
 * The first runs of a cell, and a button for more.
 *
 * @param {{now: Seen, found: RowsPublic, ask: Ask}} props
 */
function List({ now: { sweep, view }, found, ask }) {
  const { total, failures } = found;
  const rows = useSignal(found.rows);
  const more = async () => {
    const next = await attempt(() => ask(rows.value.length));
    if (next) rows.value = [...rows.value, ...next.rows];
  };
  const nothing = sweep.state === "running" ? "No run of this cell has been computed yet." : "No run of this cell was computed.";
  const some = sweep.judged ? `${failures} of ${count(total, "run")} failed` : count(total, "run");
  const hidden = sweep.axes.filter(({ name }) => name !== view.x && name !== view.y);
  const pooled = (/** @type {RowPublic} */ { conditions, seed }) =>
    [...hidden.map((axis) => `${axis.title.toLowerCase()} ${parameterValue(conditions[axis.name], axis)}`), `seed ${seed}`].join(", ");
  return html`
    <p class="hint">${total === 0 ? nothing : some}</p>
    <ol class="runs">${rows.value.map((row) => h(Run, { key: row.run, sweep, row, pooled: pooled(row) }))}</ol>
    ${rows.value.length < total && html`<button type="button" onClick=${more}>Show more</button>`}
  `;
}

/** @param {{sweep: SweepPublic, row: RowPublic, pooled: string}} props */
function Run({ sweep, row, pooled }) {
  const { run, tracker, trial, problem, success } = row;
  const verdicts = { true: "success", false: "failure", null: "" };
  const verdict = problem === null ? verdicts[`${success}`] : "not possible";
  const title = html`<span class="run-method">${trackerTitle(sweep, tracker)}</span><span>trial ${trial}</span>`;
  return html`<li class="run" data-run=${run} data-verdict=${verdict}>
    <div class="run-line">
      ${problem === null
        ? html`<a class="run-title" href=${runPage(sweep.id, run)} target="_blank" rel="noreferrer">${title}</a>`
        : html`<span class="run-title">${title}</span>`}
      <span class=${`run-verdict ${verdict}`}>${verdict}</span>
    </div>
    <p class="hint">${problem ?? outcome(sweep, row)}</p>
    <p class="hint">${pooled}</p>
    ${problem === null && sweep.trackers.length > 1 && h(Others, { sweep, row })}
  </li>`;
}

/**
 * Links to the same seed with the other trackers.
 *
 * @param {{sweep: SweepPublic, row: RowPublic}} props
 */
function Others({ sweep, row: { run, tracker } }) {
  const others = sweep.trackers.map(({ id }) => id).filter((id) => id !== tracker);
  const beside = others.slice(0, MOST_BESIDE);
  const compared = linkToReferences([`${sweep.id}:${run}`, ...beside.map((id) => `${sweep.id}:${run}:${id}`)]);
  const chip = (/** @type {string} */ words, /** @type {string} */ href, /** @type {string} */ title) =>
    html`<a class="chip-link" title=${`The same seed with ${title}`} href=${href} target="_blank" rel="noreferrer">${words}</a>`;
  return html`<p class="run-others">
    <span class="hint">Same seed</span>
    ${chip("Compare", compared, `${[tracker, ...beside].map((id) => trackerTitle(sweep, id)).join(", ")}, in step`)}
    ${others.map((id) => chip(shortOf(sweep, id), runPage(sweep.id, run, id), trackerTitle(sweep, id)))}
  </p>`;
}

/**
 * @param {SweepPublic} sweep
 * @param {RowPublic} row
 */
function outcome({ unit }, { mean_error, lost_frames, first_lost_frame }) {
  // The unit stays with its number.
  const error = mean_error === null ? "" : `error ${short(mean_error)}${unit && `\u00a0${unit}`}`;
  if (lost_frames === null) return error;
  if (lost_frames === 0) return `never lost, ${error}`;
  return `lost in ${count(lost_frames, "frame")}, first in frame ${first_lost_frame}, ${error}`;
}

effect(() => {
  if (newest.value === null) return;
  const { title, state, done, runs } = newest.value;
  setText(part("title"), title);
  document.title = `${state === "running" ? `${Math.floor((100 * done) / runs)} % · ` : ""}${title} · pftrack`;
});
begin();
showPage("sweep", null, Page, [h(CodeButton, { ask: () => request("GET sweeps/{sweep}/source-code", { sweep: lastOfAddress() }) }), h(PresentationButton, {})]);
