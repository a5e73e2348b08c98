/** The plan of a new sweep in the form, and the server's answer on it: its size, or its error. */

import { ApiError, messageOf, request, statusOf } from "../shared/api.js";
import { toast } from "../shared/dom.js";
import { decode } from "../shared/share_link.js";
import { later } from "../shared/timing.js";
import { batch, computed, effect, signal } from "../vendor/preact.js";

/** @import { Value } from "../shared/format.js" */
/** @import { Declaration, EstimatePublic, ExperimentDetail, SweepAxis, SweepCreate, UploadPublic, ValuesPublic } from "../shared/messages.js" */
/** @import { Plan } from "./store.js" */

/** The values of a parameter: a range, a list, or one value in all runs.
 *
 * @typedef {{declaration: Declaration, form: "range"|"list"|"one", start: string, stop: string, step: string, list: string}} RowDraft
 */

/** The form, with numbers as typed.
 *
 * @typedef {object} Draft
 * @property {string} title
 * @property {readonly RowDraft[]} axes
 * @property {string[]} trackers
 * @property {string} trials
 * @property {string} frames
 * @property {string} seed
 * @property {boolean} loss_probability
 * @property {readonly RowDraft[]} fixed
 * @property {readonly string[]} own Parameters of a filter file, which are known only where it is executed.
 */

/** @typedef {{experiment: ExperimentDetail, declarations: Declaration[], upload: UploadPublic|null}} Subject */
/** @typedef {{plan: Plan, estimate: EstimatePublic|null, error: unknown}} Answer */

const STEPS = 10;
const OTHER_SEEDS = 20;
const [COUNT_AFTER_MS, MEASURE_AFTER_MS, ASK_AGAIN_MS] = [150, 700, 3000];
const PLACE = /^(?:axes\.\d+|\w+)/;
const FIELDS = ["title", "axes", "trackers", "trials", "frames", "seed", "loss_probability", "parameters"];

/** The form's first content: that of the address, or an experiment's example. A link may name only the experiment. */
export const given = signal(planOfAddress());
/** The experiment and recording of the sweep. */
export const subject = signal(/** @type {Subject|null} */ (null));
export const draft = signal(
  /** @type {Draft} */ ({ title: "", axes: [], trackers: [], trials: "", frames: "", seed: "", loss_probability: false, fixed: [], own: [] }),
);
const answered = signal(/** @type {Answer|null} */ (null));

/** The plan in the server's form: an empty field is null, and the server reports what is missing. */
const plan = computed(/** @returns {Plan|null} */ () => {
  if (subject.value === null) return null;
  const { experiment, upload } = subject.value;
  const { title, axes, fixed, trials, frames, seed, own, ...rest } = draft.value;
  return {
    ...rest,
    ...(upload && { upload: upload.id, footage: given.value.footage }),
    ...(title.trim() !== "" && { title: title.trim() }),
    experiment: experiment.id,
    axes: axes.map(axisOf),
    trials: numberOf(trials),
    frames: numberOf(frames),
    seed: numberOf(seed),
    parameters: Object.fromEntries(fixed.map(({ declaration: { name, kind }, list }) => [name, valueOf(kind, list)])),
  };
});

/** The newest estimate, whether it is outdated, and whether the present plan cannot be started. */
export const size = computed(() => {
  const { plan: of, estimate = null, error = null } = answered.value ?? {};
  const isRefused = statusOf(error) === 422 || (estimate !== null && estimate.problem !== null);
  return { estimate, isStale: error !== null || of !== plan.value, isRefused };
});

/** The error, its field, and the place in the form that shows it; "" is next to the size. */
export const wrong = computed(() => {
  const { error = null, estimate = null } = answered.value ?? {};
  if (error === null) return { field: "", place: "", words: estimate?.problem ?? "" };
  const field = (error instanceof ApiError && error.field) || "";
  const [place] = PLACE.exec(field) ?? [""];
  const message = messageOf(error);
  const words = message.startsWith(`${field}: `) ? message.slice(field.length + 2) : message;
  return { field, place: FIELDS.includes(place.split(".")[0]) ? place : "", words: words.slice(0, 1).toUpperCase() + words.slice(1) };
});

/** @param {Partial<Draft>} changes */
export function change(changes) {
  draft.value = { ...draft.value, ...changes };
}

/** @param {string} name */
export function declared(name) {
  const declarations = subject.value?.experiment.declarations ?? [];
  return declarations.find((declaration) => declaration.name === name) ?? declarations[0];
}

/** @returns {Partial<SweepCreate>} */
function planOfAddress() {
  try {
    return decode(location.hash);
  } catch {
    return {};
  }
}

/** Start again with the example of another experiment.
 *
 * @param {string} experiment
 */
export function choose(experiment) {
  if (experiment === subject.value?.experiment.id) return;
  batch(() => {
    given.value = { experiment };
    subject.value = null;
    answered.value = null;
  });
}

/**
 * Fill the form in.
 *
 * @param {string} id Id of the experiment.
 */
export async function fill(id) {
  const asked = given.value;
  const upload = asked.upload ? await request("GET uploads/{upload}", { upload: asked.upload }) : null;
  const experiment = await request("GET experiments/{experiment}", { experiment: id, recording: upload?.kind });
  // Files and drawing options cannot be varied or fixed.
  const declarations = experiment.declarations.filter(({ kind, role }) => kind !== "file" && role !== "drawing");
  const axes = (asked.axes ?? []).filter(({ name }) => declarations.some((declaration) => declaration.name === name));
  // On a recording the example's scene does not exist: the first sweep is over other seeds.
  const isGiven = upload || axes.length > 0;
  const begun = isGiven ? { trials: OTHER_SEEDS, ...asked, axes } : exampleWith(await request("GET experiments/{experiment}/sweep", { experiment: id }), asked);
  // The answers for two quickly chosen experiments may arrive in the other order.
  if (given.value !== asked) return;
  batch(() => {
    subject.value = { experiment, declarations, upload };
    draft.value = draftOf(begun, upload ? upload.frames - (asked.footage?.start ?? 0) : experiment.frames);
  });
}

/** The example with the tracker and the values of a run, over one axis, so that its first result is a curve.
 *
 * @param {SweepCreate} example
 * @param {Partial<SweepCreate>} run
 * @returns {Partial<SweepCreate> & {axes: SweepAxis[]}}
 */
function exampleWith(example, { trackers, parameters }) {
  if (trackers === undefined) return example;
  return { ...example, axes: example.axes.slice(0, 1), trackers, parameters: { ...example.parameters, ...parameters } };
}

/**
 * @param {Partial<SweepCreate> & {axes: SweepAxis[]}} begun
 * @param {number} longest Default frames of a run.
 * @returns {Draft}
 */
function draftOf({ title, axes, trackers = [], trials, frames, seed, loss_probability = false, parameters = {} }, longest) {
  const isKnown = (/** @type {string} */ name) => declared(name).name === name;
  const rest = Object.entries(parameters).filter(([name]) => axes.every((axis) => axis.name !== name));
  return {
    title: title ?? "",
    axes: axes.map((axis) => rowOf(declared(axis.name), axis)),
    trackers,
    trials: `${trials}`,
    frames: `${frames ?? longest}`,
    seed: `${seed ?? 0}`,
    loss_probability,
    fixed: rest.filter(([name]) => isKnown(name)).map(([name, value]) => fixedAt(declared(name), value)),
    own: rest.map(([name]) => name).filter((name) => !isKnown(name)),
  };
}

/** @param {Pick<Declaration, "kind">} declaration */
export function isNumerical({ kind }) {
  return kind === "integer" || kind === "number";
}

/** @param {Pick<Declaration, "kind"|"choices">} declaration */
export function choicesOf({ kind, choices }) {
  return kind === "boolean" ? ["false", "true"] : choices;
}

/** A given axis, or one over the useful range of its parameter.
 *
 * @param {Declaration} declaration
 * @param {Omit<SweepAxis, "name">} [given]
 * @returns {RowDraft}
 */
export function rowOf(declaration, { start, stop, step, values } = {}) {
  const { useful, step: least } = declaration;
  const numbers = (values ?? []).filter((value) => typeof value === "number");
  const [from, to] = useful ?? [0, 0];
  const stride = Math.max(1, Math.round((to - from) / STEPS / (least ?? 1))) * (least ?? 1);
  /** @type {[unknown, unknown, number]} */
  let range = [from, to, stride];
  if (numbers.length > 1) range = [numbers[0], numbers.at(-1), numbers[1] - numbers[0]];
  if (typeof step === "number") range = [start, stop, step];
  const choices = choicesOf(declaration);
  return {
    declaration,
    form: isNumerical(declaration) && !values ? "range" : "list",
    start: `${range[0]}`,
    stop: `${range[1]}`,
    step: `${Number(range[2].toPrecision(6))}`,
    list: (values ?? (choices.length > 0 ? choices : [declaration.default])).join(", "),
  };
}

/**
 * @param {Declaration} declaration
 * @param {unknown} [value]
 * @returns {RowDraft}
 */
export function fixedAt(declaration, value = declaration.default) {
  return { ...rowOf(declaration, { values: [value] }), form: "one" };
}

/**
 * @param {RowDraft} row
 * @returns {SweepAxis}
 */
export function axisOf({ declaration, form, start, stop, step, list }) {
  const { name, kind } = declaration;
  if (form === "range") return { name, start: numberOf(start), stop: numberOf(stop), step: numberOf(step) };
  // A choice may have several words.
  const parts = list.split(choicesOf(declaration).length > 0 ? ", " : /[,;\s]+/).filter(Boolean);
  return { name, values: parts.map((part) => valueOf(kind, part)) };
}

/**
 * The same values in another form: as a list, once they are known, or as a range.
 *
 * @param {RowDraft} row
 * @param {ValuesPublic|null} known
 * @returns {RowDraft}
 */
export function inOtherForm(row, known) {
  if (row.form === "list") return { ...rowOf(row.declaration, axisOf(row)), form: "range" };
  // A range of very many values stays one.
  const isWhole = known !== null && known.count === known.first.length;
  return { ...row, form: "list", list: isWhole ? known.first.join(", ") : row.list };
}

/**
 * The first parameter of a kind that is neither varied nor fixed.
 *
 * @param {(declaration: Declaration) => boolean} isKind
 */
export function unused(isKind) {
  const used = new Set([...draft.value.axes, ...draft.value.fixed].map(({ declaration }) => declaration));
  const declarations = subject.value?.declarations ?? [];
  return declarations.find((declaration) => isKind(declaration) && !used.has(declaration)) ?? declarations[0];
}

/** The value of a field; text in place of a number is sent unchanged, so that the server names it.
 *
 * @param {Declaration["kind"]} kind
 * @param {string} text
 * @returns {Value|null}
 */
function valueOf(kind, text) {
  if (kind === "boolean") return text === "true";
  if (!isNumerical({ kind })) return text.trim();
  if (text.trim() === "") return null;
  return Number.isFinite(Number(text)) ? Number(text) : text;
}

/** @param {string} text */
function numberOf(text) {
  return /** @type {number|null} */ (valueOf("number", text));
}

// Request the size of the plan soon after each change, and its time a little later.
effect(() => {
  const now = plan.value;
  const end = new AbortController();
  if (now !== null) {
    later(() => look(now, false, end.signal), COUNT_AFTER_MS, end.signal);
    later(() => look(now, true, end.signal), MEASURE_AFTER_MS, end.signal);
  }
  return () => end.abort();
});

/**
 * @param {Plan} now
 * @param {boolean} measure
 * @param {AbortSignal} outdated Aborted when the answer is outdated.
 */
async function look(now, measure, outdated) {
  try {
    const estimate = await request("POST sweeps/estimate", { body: { .../** @type {SweepCreate} */ (now), measure } });
    if (outdated.aborted) return;
    answered.value = { plan: now, estimate, error: null };
    // A place may become free, or room on the disk.
    if (estimate.problem !== null && measure) later(() => look(now, true, outdated), ASK_AGAIN_MS, outdated);
  } catch (error) {
    if (!outdated.aborted) refuse(now, error);
  }
}

/**
 * @param {Plan} now
 * @param {unknown} error
 */
function refuse(now, error) {
  answered.value = { plan: now, estimate: answered.value?.estimate ?? null, error };
}

/** Begin the sweep, and go to its page. */
export async function begin() {
  const now = plan.value;
  if (now === null) return;
  try {
    location.assign((await request("POST sweeps", { body: /** @type {SweepCreate} */ (now) })).page);
    // Keep the button busy until the page is left, or returns from the browser's cache.
    await new Promise((resolve) => { addEventListener("pageshow", resolve, { once: true }); });
  } catch (error) {
    refuse(now, error);
    if (wrong.value.place === "") toast(wrong.value.words, { kind: "error" });
  }
}
