/** One control, made from the declaration of one parameter: it proposes values and shows what is in force. */

import { h } from "../../shared/dom.js";
import { explain, explainControl } from "../../shared/terms.js";

/** @import { Declaration } from "../../shared/messages.js" */
/** @import { Value } from "../../shared/format.js" */

/**
 * @typedef {object} Control
 * @property {HTMLElement} element
 * @property {(value: Value) => void} show
 */

/** Digits that a number is shown with. */
const DIGITS = 6;
let made = 0;

/**
 * @param {Declaration} declaration
 * @param {Value} value In force: the slider of a number reaches it.
 * @param {(value: Value) => void} propose
 * @returns {Control}
 */
export function makeControl(declaration, value, propose) {
  const { label, hint } = declaration;
  switch (declaration.kind) {
    case "boolean":
      return checkbox(label, hint, propose);
    case "choice":
      return choice(label, hint, declaration.choices.map((text) => [text, text]), propose);
    case "colour":
      return colour(declaration, propose);
    default:
      return amount(declaration, Number(value), propose);
  }
}

/**
 * @param {string} label
 * @param {string} hint
 * @param {(value: boolean) => void} propose
 * @returns {Control}
 */
export function checkbox(label, hint, propose) {
  /** @type {HTMLInputElement} */
  const box = h("input", { type: "checkbox", on: { change: () => propose(box.checked) } });
  const element = h("label", { class: "control check" }, box, h("span", {}, label));
  if (hint !== "") {
    box.setAttribute("aria-description", hint);
    explainControl(element, hint);
  }
  return { element, show: (value) => (box.checked = Boolean(value)) };
}

/**
 * @param {string} label
 * @param {string} hint
 * @param {[string, string][]} options Values with their titles.
 * @param {(value: string) => void} propose
 * @returns {Control}
 */
export function choice(label, hint, options, propose) {
  /** @type {HTMLSelectElement} */
  const select = h(
    "select",
    { on: { change: () => propose(select.value) } },
    options.map(([value, title]) => h("option", { value }, title)),
  );
  return { element: labelled(label, hint, select), show: (value) => (select.value = String(value)) };
}

/**
 * A box for a number, and nothing else.
 *
 * @param {string} label
 * @param {string} hint
 * @param {{min?: number|null, max?: number|null}} bounds
 * @param {(value: number) => void} propose
 * @returns {Control}
 */
export function numberBox(label, hint, bounds, propose) {
  const { box, show } = numberInput(bounds, propose);
  return { element: labelled(label, hint, box), show };
}

/**
 * A box that takes whatever is allowed, with a slider over the useful range, widened to the value in force.
 *
 * @param {Declaration} declaration
 * @param {number} inForce
 * @param {(value: number) => void} propose
 * @returns {Control}
 */
function amount({ label, hint, minimum, maximum, step, useful }, inForce, propose) {
  const bounds = { min: minimum, max: maximum };
  const [low, high] = useful === null ? [inForce, inForce] : [Math.min(useful[0], inForce), Math.max(useful[1], inForce)];
  if (low === high) return numberBox(label, hint, bounds, propose);
  const range = h("input", { type: "range", min: low, max: high, step: step ?? "any", "aria-label": label, "aria-description": hint });
  const { box, show: showInBox } = numberInput(bounds, (value) => {
    range.value = String(value);
    propose(value);
  });
  range.addEventListener("input", () => {
    showInBox(range.valueAsNumber);
    propose(range.valueAsNumber);
  });
  const show = (/** @type {Value} */ value) => {
    range.value = String(value);
    showInBox(value);
  };
  const element = h("div", { class: "control amount-control" }, labelled(label, hint, box), range);
  return { element, show };
}

/**
 * @param {Declaration} declaration
 * @param {(value: string) => void} propose
 * @returns {Control}
 */
function colour({ label, hint }, propose) {
  /** @type {HTMLInputElement} */
  const box = h("input", { type: "color", on: { input: () => propose(box.value) } });
  return { element: labelled(label, hint, box), show: (value) => (box.value = String(value)) };
}

/**
 * A box to type a number into. What is half typed is left alone until it is finished.
 *
 * @param {{min?: number|null, max?: number|null}} bounds
 * @param {(value: number) => void} propose
 * @returns {{box: HTMLInputElement, show: (value: Value) => void}}
 */
function numberInput({ min, max }, propose) {
  // Whether a value is allowed is for the server to say, in words that name the bounds.
  const box = h("input", { type: "number", min, max, step: "any", inputmode: "decimal" });
  let inForce = "";
  let isTyping = false;
  box.addEventListener("input", () => (isTyping = true));
  box.addEventListener("change", () => {
    isTyping = false;
    if (Number.isFinite(box.valueAsNumber)) propose(box.valueAsNumber);
    else box.value = inForce;
  });
  // Left with the number that it had before the typing, it tells of no change.
  box.addEventListener("blur", () => {
    if (isTyping) box.value = inForce;
    isTyping = false;
  });
  const show = (/** @type {Value} */ value) => {
    inForce = shown(Number(value));
    if (!isTyping) box.value = inForce;
  };
  return { box, show };
}

/**
 * @param {string} label
 * @param {string} hint
 * @param {HTMLElement} input
 */
function labelled(label, hint, input) {
  made += 1;
  const id = `control-${made}`;
  input.id = id;
  input.setAttribute("aria-description", hint);
  const named = h("label", { for: id }, label);
  explain(named, { own: hint });
  return h("div", { class: "control" }, named, input);
}

/** @param {number} value */
function shown(value) {
  return String(Number.isInteger(value) ? value : Number(value.toPrecision(DIGITS)));
}
