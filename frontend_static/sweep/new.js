/** The page of a new sweep: axes, trackers and repetitions, with its size and time before it starts. */

import { request } from "../shared/api.js";
import { Boxes, Segments, Select } from "../shared/dom.js";
import { bytes, count, duration } from "../shared/format.js";
import { Doing, Loaded, showPage } from "../shared/page.js";
import { h, html } from "../vendor/preact.js";
import * as plan from "./plan.js";
import { change, choicesOf, declared, draft, isNumerical, rowOf, size, subject, wrong } from "./plan.js";

/** @import { Declaration, ExperimentPublic } from "../shared/messages.js" */
/** @import { RowDraft, Subject } from "./plan.js" */

const PREVIEWED = 12;
const FAILED = "Couldn't prepare the form";
const BONES = html`<div class="plan-part"><div class="bone shimmer"></div><div class="bone short shimmer"></div></div>`;
const FORMS = [
  { value: "range", words: "Range" },
  { value: "list", words: "List" },
];

/** @param {{experiments: ExperimentPublic[]}} props */
function Form({ experiments }) {
  const now = subject.value;
  const { experiment, upload } = plan.given.value;
  const { id, clip_title } = experiments.find((each) => each.id === experiment) ?? experiments[0];
  const all = experiments.map((each) => ({ value: each.id, words: each.title }));
  const options = upload ? [{ value: id, words: clip_title }] : all;
  const about = now?.upload ? `All runs are on ${now.upload.name}; without an axis the trials are other seeds.` : "";
  const submit = (/** @type {Event} */ event) => {
    event.preventDefault();
    plan.begin();
  };
  return html`
    <form class="plan-form" novalidate onSubmit=${submit}>
      <section class="plan-part">
        <h2>Experiment</h2>
        ${h(Select, { label: "Experiment", options, value: id, choose: plan.choose, field: "experiment" })}
        ${now && html`<p class="hint">${about || `${now.experiment.question} ${now.experiment.description}`}</p>`}
      </section>
      ${h(Loaded, { key: id, load: () => plan.fill(id).then(() => h(Parts, {})), failed: FAILED, bones: BONES })}
    </form>
    ${now && h(Size, {})}
  `;
}

/** The rest of the form, once the parameters of the experiment are known. */
function Parts() {
  const now = subject.value;
  return now && [h(AxesPart, {}), h(TrackersPart, { now }), h(RunsPart, { now }), h(FixedPart, {})];
}

/** @param {{place: string}} props The place of an error about a field there. */
function Wrong({ place }) {
  return wrong.value.place === place && wrong.value.words && html`<p class="wrong" role="alert">${wrong.value.words}</p>`;
}

/** An input field; the server reports its errors.
 *
 * @param {{field: string, label: string, value: string, give: (value: string) => void, type?: string, step?: number|null}} props
 */
function Input({ field, label, value, give, type = "number", step }) {
  const input = (/** @type {{currentTarget: HTMLInputElement}} */ { currentTarget }) => give(currentTarget.value);
  const isWrong = wrong.value.field === field;
  return html`<input type=${type} step=${step ?? "any"} aria-label=${label} aria-invalid=${isWrong} data-field=${field} value=${value} onInput=${input} />`;
}

function AxesPart() {
  const { axes } = draft.value;
  return html`<section class="plan-part" data-field="axes">
    <h2>Axes</h2>
    <div class="axes">${axes.map((row, place) => h(Row, { rows: "axes", row, place, field: `axes.${place}` }))}</div>
    ${h(Wrong, { place: "axes" })}
    <div><button type="button" data-role="add-axis" onClick=${() => change({ axes: [...axes, rowOf(plan.unused(isNumerical))] })}>Add an axis</button></div>
    <p class="hint">The sweep runs all combinations. A map shows two axes of your choice; the others are pooled.</p>
  </section>`;
}

/** @param {{rows: "axes"|"fixed", row: RowDraft, place: number, field: string}} props A parameter, and its values. */
function Row({ rows, row, place, field }) {
  const all = draft.value[rows];
  const { declaration } = row;
  const isAxis = rows === "axes";
  const found = size.value.estimate?.axes[place];
  const known = isAxis && found?.name === declaration.name ? found : null;
  const become = (/** @type {RowDraft} */ other) => change({ [rows]: all.with(place, other) });
  const options = (subject.value?.declarations ?? []).map(({ name, label, group }) => ({ value: name, words: label, group }));
  const choose = (/** @type {string} */ name) => become(isAxis ? rowOf(declared(name)) : plan.fixedAt(declared(name)));
  // Without a recording at least one axis is needed; on a recording, other seeds are enough.
  const isRemovable = !isAxis || all.length > 1 || subject.value?.upload;
  return html`<div class="axis" role="group" aria-label=${isAxis ? `Axis ${place + 1}` : declaration.title} data-field=${field}>
    <div class="axis-head">
      ${h(Select, { label: isAxis ? "Varied parameter" : "Fixed parameter", options, value: declaration.name, choose, field: `${field}.name` })}
      ${isAxis && isNumerical(declaration) && h(Segments, {
        label: "Form",
        options: FORMS,
        value: row.form,
        choose: (form) => form !== row.form && become(plan.inOtherForm(row, known)),
      })}
      ${isRemovable && html`<button type="button" class="quiet" onClick=${() => change({ [rows]: all.toSpliced(place, 1) })}>Remove</button>`}
    </div>
    <div class="axis-values">${h(Values, { row, field, become })}</div>
    ${isAxis && h(Wrong, { place: field })}
    <p class="hint">${known ? preview(known, declaration) : declaration.description} ${allowed(declaration)}</p>
  </div>`;
}

/** @param {{row: RowDraft, field: string, become: (other: RowDraft) => void}} props */
function Values({ row, field, become }) {
  const { declaration } = row;
  const { title, unit, step } = declaration;
  const options = choicesOf(declaration).map((value) => ({ value, words: value }));
  const give = (/** @type {string} */ list) => become({ ...row, list });
  const number = (/** @type {"start"|"stop"|"step"} */ name, /** @type {string} */ label) =>
    h(Input, { field: `${field}.${name}`, label, value: row[name], give: (value) => become({ ...row, [name]: value }) });
  if (row.form === "range") return html`from ${number("start", "From")} to ${number("stop", "To")} in steps of ${number("step", "Step")}${unit}`;
  if (row.form === "one") {
    if (options.length > 0) return h(Select, { label: title, options, value: row.list, choose: give });
    return [h(Input, { field, label: title, type: isNumerical(declaration) ? "number" : "text", step, value: row.list, give }), unit];
  }
  if (options.length > 0) return h(Boxes, { options, chosen: row.list.split(", "), choose: (chosen) => give(chosen.join(", ")) });
  return [h(Input, { field: `${field}.values`, label: "Values, separated by commas", type: "text", value: row.list, give }), unit];
}

/**
 * @param {{count: number, first: readonly unknown[]}} known
 * @param {Declaration} declaration
 */
function preview({ count: all, first }, { unit }) {
  return `${count(all, "value")}: ${first.slice(0, PREVIEWED).join(", ")}${all > PREVIEWED ? ", …" : ""}${unit && ` ${unit}`}.`;
}

/**
 * "Allowed 0 to 640 px."
 *
 * @param {Declaration} declaration
 */
function allowed({ minimum, maximum, unit }) {
  return minimum === null || maximum === null ? "" : `Allowed ${minimum} to ${maximum.toLocaleString("en-GB")}${unit && ` ${unit}`}.`;
}

/** @param {{now: Subject}} props */
function TrackersPart({ now: { experiment } }) {
  const options = experiment.trackers.map(({ id, title, description }) => ({ value: id, words: title, hint: description }));
  return html`<section class="plan-part" data-field="trackers">
    <h2>Trackers</h2>
    <div class="methods">${h(Boxes, { options, chosen: draft.value.trackers, choose: (trackers) => change({ trackers }) })}</div>
    ${h(Wrong, { place: "trackers" })}
    <p class="hint">All trackers get the same scenes and seeds.</p>
  </section>`;
}

/** @param {{now: Subject}} props */
function RunsPart({ now: { experiment } }) {
  const { loss_probability } = draft.value;
  const able = experiment.trackers.filter(({ id }) => experiment.loss_trackers.includes(id));
  const who = able.length === experiment.trackers.length ? "" : ` Only some trackers estimate it: ${able.map(({ title }) => title).join(", ")}.`;
  const field = (/** @type {"trials"|"frames"|"seed"|"title"} */ name, /** @type {string} */ title, /** @type {string} */ type = "number") =>
    html`<label class="field" data-field=${name}>
      <span>${title}</span>
      ${h(Input, { field: name, label: title, type, value: draft.value[name], give: (value) => change({ [name]: value }) })}
      ${h(Wrong, { place: name })}
    </label>`;
  return html`<section class="plan-part">
    <h2>Runs</h2>
    <div class="plan-fields">
      ${field("trials", "Trials in each cell")} ${field("frames", "Frames of a run")} ${field("seed", "Seed")}
      <div class="grow">${field("title", "Title (optional)", "text")}</div>
    </div>
    ${able.length > 0 && html`<div data-field="loss_probability">
      <label class="check">
        <input type="checkbox" checked=${loss_probability} onChange=${() => change({ loss_probability: !loss_probability })} />
        Also measure the probability of loss
      </label>
      ${h(Wrong, { place: "loss_probability" })}
      <p class="hint">The trackers' own estimate, without the truth.${who} It slows fast trackers; the estimate includes that.</p>
    </div>`}
  </section>`;
}

function FixedPart() {
  const { fixed, own } = draft.value;
  const isKind = (/** @type {Declaration} */ declaration) => isNumerical(declaration) || declaration.kind === "choice";
  return html`<section class="plan-part" data-field="parameters">
    <h2>Fixed parameters</h2>
    <p class="hint">All other parameters keep the experiment's defaults.</p>
    <div>
      ${fixed.map((row, place) => h(Row, { rows: "fixed", row, place, field: `parameters.${row.declaration.name}` }))}
      ${own.length > 0 && html`<p class="hint">Parameters of a file keep the file's defaults: ${own.join(", ")}.</p>`}
    </div>
    ${h(Wrong, { place: "parameters" })}
    <div>
      <button type="button" data-role="add-fixed" onClick=${() => change({ fixed: [...fixed, plan.fixedAt(plan.unused(isKind))] })}>Fix a parameter</button>
    </div>
  </section>`;
}

/** The size and the time of the plan, and the start button. */
function Size() {
  const { estimate, isStale, isRefused } = size.value;
  const seconds = estimate?.seconds ?? null;
  const time = seconds === null ? html`<small>measuring the time</small>` : html`${duration(seconds)} <small>to compute</small>`;
  const processes = estimate?.jobs === 1 ? "1 process" : `${estimate?.jobs} processes`;
  return html`<aside class=${isStale ? "plan-size stale" : "plan-size"} aria-label="Size">
    <div role="status">
      <p class="figure">${estimate ? html`${estimate.runs.toLocaleString("en-GB")} <small>${estimate.runs === 1 ? "run" : "runs"}</small>` : "–"}</p>
      <div class="size-words">
        ${estimate && html`
          <p>${count(estimate.conditions, "condition")} × ${count(estimate.runs / estimate.conditions, "run")}</p>
          <p class="hint">${count(estimate.cells, "cell")} a map, at most ${bytes(estimate.bytes)}</p>
        `}
      </div>
    </div>
    <div>
      <p class="figure" data-role="time">${isRefused ? "–" : time}</p>
      <p class="hint">${!isRefused && seconds !== null && `Measured on a few runs, for ${processes}; add some seconds for the start.`}</p>
    </div>
    ${wrong.value.place === "" && wrong.value.words && html`<p class="note">${wrong.value.words}</p>`}
    ${h(Doing, { label: "Start the sweep", run: plan.begin, disabled: isRefused, class: "primary" })}
  </aside>`;
}

async function load() {
  return h(Form, { experiments: await request("GET experiments") });
}

showPage("plan", null, () => h(Loaded, { load, failed: FAILED, bones: BONES }));
