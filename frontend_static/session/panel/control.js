/** Controls made from the declaration of one parameter: each proposes values and shows what is in force. */

import { explainControl } from "../../shared/terms.js";
import { h, html, useMemo, useSignal } from "../../vendor/preact.js";

/** @import { Declaration } from "../../shared/messages.js" */
/** @import { Value } from "../../shared/format.js" */
/** @import { Child } from "../../vendor/preact.js" */
/** @import { Layers } from "../flat/layers.js" */

/** Digits that a number is shown with. */
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
      return h(Labelled, { label, hint, field: (id) => html`<input type="color" id=${id} value=${value} onInput=${read((box) => propose(box.value))} />` });
    default:
      return h(Amount, { label, hint, min, max, step, useful, value: Number(value), propose });
  }
}

/** @param {{label: string, hint?: string, value: boolean, propose: (value: boolean) => void}} props */
export function Check({ label, hint = "", value, propose }) {
  return html`<label class="control check" ref=${explained(hint)}>
    <input type="checkbox" checked=${value} aria-description=${hint || null} onChange=${read((box) => propose(box.checked))} />
    <span>${label}</span>
  </label>`;
}

/** @param {{label: string, hint: string, options: string[][], value: string, propose: (value: string) => void}} props */
export function Choice({ label, hint, options, value, propose }) {
  const choices = options.map(([each, title]) => html`<option value=${each} selected=${each === value}>${title}</option>`);
  const choose = read((list) => propose(list.value));
  return h(Labelled, { label, hint, field: (id) => html`<select id=${id} aria-description=${hint} onChange=${choose}>${choices}</select>` });
}

/**
 * A field that takes whatever is allowed, with a slider over the useful range, widened to the value in force. The field is the
 * stop of the tab key for both: its arrows move by the same steps.
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
  const slide = read((slider) => propose(slider.valueAsNumber));
  return html`<div class="control amount-control">
    ${h(NumberBox, field)}
    <input type="range" tabindex="-1" min=${low} max=${high} ...${look} onInput=${slide} />
  </div>`;
}

/**
 * A field for a number. What is half typed is left alone until it is finished; whether a value is allowed is for the server
 * to say, in words that name the bounds.
 *
 * @param {NumberProps} props
 */
export function NumberBox({ label, hint, min, max, step, value, propose }) {
  const typed = useSignal(/** @type {string|null} */ (null));
  const type = read((box) => (typed.value = box.value));
  const finish = read((box) => {
    const number = box.valueAsNumber;
    typed.value = null;
    if (Number.isFinite(number)) propose(number);
    else box.value = shown(value);
  });
  const leave = read((box) => {
    if (typed.value !== null) box.value = shown(value);
    typed.value = null;
  });
  // It belongs to no form: its step is that of the arrows, and no bound for what is typed.
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

/**
 * A listener that is given the field.
 *
 * @param {(field: HTMLInputElement) => void} act
 */
function read(act) {
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

/**
 * A box for each layer of a run's drawings.
 *
 * @param {{layers: Layers}} props
 */
export function LayerBoxes({ layers }) {
  return layers.declared.map(({ name, title }) =>
    h(Check, { key: name, label: title, value: layers.isShown(name), propose: (wanted) => layers.set(name, wanted) }),
  );
}
