/** The controls to try in a session: tracker, the parameters that the run's preset is about, and behind *More* all others that the tracker
 * reads, the seed, and the layers.
 * A control only proposes a value. The session accepts or refuses it, and the panel shows the session's value. */

import { Select } from "../shared/dom.js";
import { explainControl } from "../shared/terms.js";
import { later } from "../shared/timing.js";
import { remember, remembered } from "../shared/visitor.js";
import { h, html, useComputed, useEffect, useMemo, useSignal, useSignalEffect } from "../vendor/preact.js";
import { Proposals, sendValues } from "./steering.js";
import { StopAtLoss } from "./transport.js";
import { Exploration, settingsOf } from "./why/loss.js";

/** @import { Value } from "../shared/format.js" */
/** @import { Bands, Declaration, SessionPublic } from "../shared/messages.js" */
/** @import { Child } from "../vendor/preact.js" */
/** @import { Layers } from "./flat/drawing.js" */
/** @import { Mounted } from "./mount.js" */
/** @import { Values } from "./steering.js" */

// Controls made from the declaration of one parameter: each proposes values and shows the current one.

/** Significant digits of a shown number. */
const DIGITS = 6;
let made = 0;

/** @param {{declaration: Declaration, value: Value, propose: (value: Value) => void}} props */
export function DeclaredControl({ declaration, value, propose }) {
  const { label, hint, minimum: min, maximum: max, step, useful } = declaration;
  switch (declaration.kind) {
    case "boolean":
      return h(Check, { label, hint, value: Boolean(value), propose });
    case "choice":
      return h(Choice, { label, hint, options: declaration.choices.map((text) => [text, text]), value: String(value), propose });
    case "colour":
      return h(Labelled, { label, hint, field: (id) => html`<input type="color" id=${id} value=${value} onInput=${onField((box) => propose(box.value))} />` });
    default:
      return h(Amount, { label, hint, min, max, step, useful, value: Number(value), propose });
  }
}

/** @param {{label: string, hint?: string, value: boolean, propose: (value: boolean) => void}} props */
export function Check({ label, hint = "", value, propose }) {
  return html`<label class="control check" ref=${explained(hint)}>
    <input type="checkbox" checked=${value} aria-description=${hint || null} onChange=${onField((box) => propose(box.checked))} />
    <span>${label}</span>
  </label>`;
}

/** @param {{label: string, hint: string, options: string[][], value: string, propose: (value: string) => void}} props */
export function Choice({ label, hint, options, value, propose }) {
  const choices = options.map(([each, title]) => ({ value: each, words: title }));
  const look = { label, "aria-description": hint, options: choices, value, choose: propose };
  return h(Labelled, { label, hint, field: (id) => h(Select, { id, ...look }) });
}

/** A field for all allowed values, with a slider over the useful range, widened to the current value. The field is the tab stop of both:
 * its arrow keys move by the same steps.
 *
 * @param {NumberProps & {useful: [number, number]|null}} props
 *
 * @typedef {object} NumberProps
 * @property {string} label
 * @property {string} hint
 * @property {number|null} [min]
 * @property {number|null} [max]
 * @property {number|null} [step]
 * @property {number} value
 * @property {(value: number) => void} propose
 */
function Amount({ useful, ...field }) {
  const { label, hint, step, value, propose } = field;
  const [low, high] = useful === null ? [value, value] : [Math.min(useful[0], value), Math.max(useful[1], value)];
  if (low === high) return h(NumberBox, field);
  const look = { step: step ?? "any", value, "aria-label": label, "aria-description": hint };
  const slide = onField((slider) => propose(slider.valueAsNumber));
  return html`<div class="control amount-control">
    ${h(NumberBox, field)}
    <input type="range" tabindex="-1" min=${low} max=${high} ...${look} onInput=${slide} />
  </div>`;
}

/**
 * A field for a number. A half-typed value is left alone until it is finished; the server decides whether a value is allowed, and names the
 * bounds.
 *
 * @param {NumberProps} props
 */
export function NumberBox({ label, hint, min, max, step, value, propose }) {
  const typed = useSignal(/** @type {string|null} */ (null));
  const type = onField((box) => (typed.value = box.value));
  const leave = () => (typed.value = null);
  const finish = onField(({ valueAsNumber: number }) => {
    leave();
    if (Number.isFinite(number)) propose(number);
  });
  // It belongs to no form: its step is only that of the arrow keys, and does not restrict typed values.
  const look = { min, max, form: "", step: step ?? "any", "aria-description": hint, value: typed.value ?? shown(value) };
  const field = (/** @type {string} */ id) =>
    html`<input type="number" inputmode="decimal" id=${id} ...${look} onInput=${type} onChange=${finish} onBlur=${leave} />`;
  return h(Labelled, { label, hint, field });
}

/** @param {{label: string, hint: string, field: (id: string) => Child}} props */
function Labelled({ label, hint, field }) {
  const id = useMemo(() => `control-${(made += 1)}`, []);
  return html`<div class="control"><label for=${id} ref=${explained(hint)}>${label}</label>${field(id)}</div>`;
}

/** A listener that gets the field.
 *
 * @param {(field: HTMLInputElement) => void} act
 */
function onField(act) {
  return (/** @type {Event & {currentTarget: HTMLInputElement}} */ { currentTarget }) => act(currentTarget);
}

/** @param {string} hint */
function explained(hint) {
  return (/** @type {HTMLElement|null} */ element) => element !== null && hint !== "" && explainControl(element, hint);
}

/** @param {number} value */
function shown(value) {
  return String(Number.isInteger(value) ? value : Number(value.toPrecision(DIGITS)));
}

/** A checkbox for each layer of a run's drawings.
 *
 * @param {{layers: Layers}} props
 */
export function LayerBoxes({ layers }) {
  return layers.declared.map(({ name, title }) =>
    h(Check, { key: name, label: title, value: layers.isShown(name), propose: (wanted) => layers.set(name, wanted) }),
  );
}

// Other seeds: a switch that draws a band behind the curve of the error, and shows the share of runs that hold.

/** Delay, since a dragged slider changes twenty times a second. */
const SETTLE_MS = 150;
const HINT = "Forty runs with other random numbers on the same scene: the 10, 50 and 90 % quantiles of their errors are drawn behind the curve";

/** @param {{view: Mounted}} props */
function OtherSeeds({ view: { store, signal: end } }) {
  const isOn = useSignal(false);
  const exploration = useMemo(() => new Exploration(store, end), []);
  const settings = useComputed(() => settingsOf(store.session));
  useSignalEffect(() => {
    if (isOn.value && settings.value !== "") return later(() => exploration.begin({ kind: "ensemble" }), SETTLE_MS, end);
    exploration.stop();
    exploration.found.value = null;
    return undefined;
  });
  const result = exploration.found.value?.result;
  const bands = result && "holding" in result ? result : null;
  useEffect(() => {
    store.ensemble.value = bands;
  }, [bands]);
  // A replay does not depend on the seed.
  if (!store.isAwake || store.known.trackers.some(({ id, replays }) => id === store.known.tracker && replays)) return null;
  return html`<div class="explore" role="group" aria-label="Other seeds">
    <button type="button" class="chip" aria-pressed=${String(isOn.value)} title=${HINT} onClick=${() => (isOn.value = !isOn.value)}>Other seeds</button>
    <output class="explore-words">${isOn.value && (exploration.error.value || words(bands, store.known.position))}</output>
  </div>`;
}

/** The number of runs that hold in a frame, in words.
 *
 * @param {Bands|null} bands
 * @param {number} frame
 */
function words(bands, frame) {
  if (bands === null) return "computing…";
  const { holding: { [frame]: share }, computed: { [frame]: runs = 0 } } = bands;
  if (share === undefined) return "not computed yet";
  return share === null ? `${runs} runs` : `${Math.round(share * runs)} of ${runs} hold in this frame`;
}

const TRACKER_HINT = "The method that follows the target; a change takes effect from the next frame.";
const FIT_HINT = "Find the values under which the data are most probable, instead of tuning by eye.";
const SEED_HINT = "The same seed gives the same scene and the same run, to the bit. A change starts the run again.";
/** Most parameters shown first. */
const FIRST = 5;
/** Most parameters shown first in a run without a preset. */
const FIRST_OF_ALL = 3;

/** @param {{view: Mounted}} props */
export function Panel({ view }) {
  const { store, scene, signal: end } = view;
  const { session } = store;
  const proposals = useMemo(() => new Proposals((values) => sendValues(store, values), end), []);
  /** On a narrow page the panel opens above the rest. */
  const isOpen = useSignal(false);
  if (session === null) return null;
  const { parameters, tracker, trackers, recipe, title } = session;
  /** @type {Values} */
  const inForce = { ...parameters, tracker, seed: recipe.seed, ...proposals.held };
  const of = (/** @type {string} */ name) => (/** @type {import("../shared/format.js").Value} */ value) => proposals.propose(name, value);
  const control = (/** @type {Declaration} */ declaration) =>
    h(DeclaredControl, { key: declaration.name, declaration, value: inForce[declaration.name], propose: of(declaration.name) });
  const read = readBy(session);
  const first = firstOf(session, read);
  const others = read.filter((each) => !first.includes(each));
  const groups = [...new Set(others.map(({ group }) => group))];
  const layers = scene?.layers ?? null;
  const options = trackers.map((each) => [each.id, each.title]);
  const fit = async () => (await import("./fit.js")).fitDialog(store);
  const opener = html`<button type="button" class="controls-opener" aria-expanded=${String(isOpen.value)} onClick=${() => (isOpen.value = !isOpen.value)}>
    ${isOpen.value ? "Close" : "Parameters"}
  </button>`;
  const more = [
    h(NumberBox, { label: "Seed", hint: SEED_HINT, min: 0, step: 1, value: Number(inForce.seed), propose: of("seed") }),
    scene !== null && h(OtherSeeds, { view }),
    h(StopAtLoss, { view }),
    (session.fittable[tracker] ?? []).length > 0 && html`<button type="button" class="quiet" title=${FIT_HINT} onClick=${fit}>Fit noise to data…</button>`,
    groups.map((group) => {
      const members = others.filter((each) => each.group === group);
      return h(Fold, { key: group, experiment: title, title: group || "Parameters" }, members.map(control));
    }),
    layers !== null && layers.declared.length > 0 && h(Fold, { experiment: title, title: "What to draw" }, h(LayerBoxes, { layers })),
  ];
  return html`<div class="panel-body" data-open=${String(isOpen.value)} inert=${!store.isSteerable}>
    <h2>Try</h2>
    ${opener}
    <div class="panel-controls">
      ${h(Choice, { label: "Tracker", hint: TRACKER_HINT, options, value: String(inForce.tracker), propose: of("tracker") })}
      ${first.map(control)}
      ${h(Fold, { experiment: title, title: "More", name: "More parameters" }, more)}
      ${h(Effect, { session })}
    </div>
  </div>`;
}

/** The parameters that a session's tracker reads, without files, which the menu imports.
 *
 * @param {SessionPublic} session
 */
export function readBy({ declarations, parameters, tracker }) {
  return declarations.filter(
    ({ name, kind, trackers }) => name in parameters && kind !== "file" && (trackers.length === 0 || trackers.includes(tracker)),
  );
}

/** The parameters of a person's own filter, and those that the preset is about; or else the first ones with a slider.
 *
 * @param {SessionPublic} session
 * @param {Declaration[]} read Parameters that the tracker reads.
 */
function firstOf({ about, recipe, tracker }, read) {
  const own = tracker in (recipe.filters ?? {}) ? read.filter(({ trackers }) => trackers.length === 1) : [];
  const first = [...own, ...about.flatMap((name) => read.filter((each) => each.name === name))].slice(0, FIRST);
  return first.length > 0 ? first : read.filter(({ useful }) => useful !== null).slice(0, FIRST_OF_ALL);
}

/** The effect of a change, if it does more than take effect from the next frame.
 *
 * @param {{session: SessionPublic}} props
 */
function Effect({ session: { branch_point: frame, position, frames, playing } }) {
  const isAtEnd = position === frames - 1;
  const effect = isAtEnd ? `The run has ended. A change runs it again from frame ${frame}, as a branch.` : `A change at frame ${frame} makes a branch.`;
  return html`<p class="control-effect" role="status">${frame !== null && !playing && effect}</p>`;
}

/** A fold whose state is stored in this browser for each experiment. The 3-D scene's panel stores its folds in the same place (`folds.js`
 * of the viser adapter).
 *
 * @param {{experiment: string, title: string, name?: string, children?: Child}} props `name` is its name in the scene's panel
 */
function Fold({ experiment, title, name = title, children }) {
  const place = `pftrack-folds ${experiment}`;
  const kept = () => JSON.parse(remembered(place) ?? "{}");
  // On a press by mouse or key: `toggle` would also fire for folds that are open from the start.
  const press = (/** @type {Event & {currentTarget: HTMLElement}} */ { currentTarget }) => {
    remember(place, JSON.stringify({ ...kept(), [name]: !currentTarget.parentElement?.hasAttribute("open") }));
  };
  return html`<details class="control-group" open=${Boolean(kept()[name])}><summary onClick=${press}>${title}</summary>${children}</details>`;
}
