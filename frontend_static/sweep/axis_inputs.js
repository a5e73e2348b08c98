/** What the values of an axis are typed into: three numbers, a list, or boxes for choices. */

import { h } from "../shared/dom.js";
import { numberOf } from "./fields.js";

/** @import { Value } from "../shared/format.js" */
/** @import { Declaration, SweepAxis } from "../shared/messages.js" */

/** @typedef {"range"|"list"} Form Of an axis of numbers. */
/** @typedef {Omit<SweepAxis, "name">} Values */
/** @typedef {{element: HTMLElement, fields: Record<string, HTMLElement>, read: () => Values}} Inputs `fields` by the server's names. */

const STEPS = 5;
const LONGEST_LIST = 100;

/** @param {Declaration} declaration */
export function isNumerical({ kind }) {
  return kind === "integer" || kind === "number";
}

/**
 * @param {Declaration} declaration
 * @param {Form} form
 * @param {Values} given
 * @param {() => void} changed
 * @returns {Inputs}
 */
export function axisInputs(declaration, form, given, changed) {
  if (declaration.kind === "boolean") return choiceInputs(["false", "true"], (text) => text === "true", given, changed);
  if (!isNumerical(declaration) && declaration.choices.length > 0) return choiceInputs(declaration.choices, String, given, changed);
  return isNumerical(declaration) && form === "range" ? rangeInputs(declaration, given, changed) : listInput(declaration, given, changed);
}

/**
 * @param {Declaration} declaration
 * @param {Values} given
 * @param {() => void} changed
 * @returns {Inputs}
 */
function rangeInputs(declaration, given, changed) {
  const { minimum, maximum, unit } = declaration;
  const { start, stop, step } = rangeOf(declaration, given);
  /**
   * @param {string} label
   * @param {number} value
   * @param {{min?: number|null, max?: number|null}} [bounds]
   */
  const input = (label, value, bounds) => h("input", { type: "number", value, ...bounds, step: "any", "aria-label": label, on: { input: changed } });
  const bounds = { min: minimum, max: maximum };
  const fields = { start: input("From", start, bounds), stop: input("To", stop, bounds), step: input("Step", step) };
  return {
    element: h("div", { class: "axis-values" }, "from ", fields.start, " to ", fields.stop, " in steps of ", fields.step, unit),
    fields,
    read: () => ({ start: numberOf(fields.start), stop: numberOf(fields.stop), step: numberOf(fields.step) }),
  };
}

/**
 * From where to where in which steps, made up where it is not given: then the default lies in the middle, from its half to one
 * and a half times as much, as far as the bounds allow.
 *
 * @param {Declaration} declaration
 * @param {Values} given
 */
export function rangeOf(declaration, given) {
  const numbers = (given.values ?? []).filter((value) => typeof value === "number");
  const usual = numbers.length > 1 ? Number((numbers[1] - numbers[0]).toPrecision(6)) : usualStep(declaration);
  const step = given.step ?? usual;
  const below = Number((Number(declaration.default) - ((STEPS - 1) / 2) * step).toPrecision(10));
  const start = given.start ?? numbers[0] ?? Math.max(declaration.minimum ?? -Infinity, below);
  const end = Number((start + (STEPS - 1) * step).toPrecision(10));
  return { start, step, stop: given.stop ?? numbers.at(-1) ?? Math.min(declaration.maximum ?? Infinity, end) };
}

/**
 * A quarter of the default, or of the useful range where that is 0, in whole steps of the slider.
 *
 * @param {Declaration} declaration
 */
function usualStep({ default: given, useful, step }) {
  const least = step ?? 1;
  const span = Math.abs(Number(given)) || (useful ? useful[1] - useful[0] : (STEPS - 1) * least);
  return Number((Math.max(1, Math.round(span / (STEPS - 1) / least)) * least).toPrecision(6));
}

/**
 * @param {Declaration} declaration
 * @param {Values} given
 * @param {() => void} changed
 * @returns {Inputs}
 */
function listInput(declaration, given, changed) {
  const numerical = isNumerical(declaration);
  const values = given.values ?? listOf(given) ?? [declaration.default];
  const inputmode = numerical ? "decimal" : null;
  const input = h("input", { type: "text", value: values.join(", "), "aria-label": "Values, separated by commas", inputmode, on: { input: changed } });
  // What is no number is sent as it stands, so that the server names it.
  const one = (/** @type {string} */ text) => (numerical && Number.isFinite(Number(text)) ? Number(text) : text);
  const read = () => ({ values: input.value.split(/[,;\s]+/).filter(Boolean).map(one) });
  return { element: h("div", { class: "axis-values" }, input, declaration.unit), fields: { values: input }, read };
}

/**
 * @param {string[]} options
 * @param {(text: string) => Value} valueOf
 * @param {Values} given
 * @param {() => void} changed
 * @returns {Inputs}
 */
function choiceInputs(options, valueOf, given, changed) {
  const chosen = (given.values ?? options).map(String);
  const boxes = options.map((value) => h("input", { type: "checkbox", value, checked: chosen.includes(value), on: { change: changed } }));
  const element = h("div", { class: "axis-values" }, boxes.map((box) => h("label", {}, box, box.value)));
  const read = () => ({ values: boxes.filter((box) => box.checked).map((box) => valueOf(box.value)) });
  return { element, fields: { values: element }, read };
}

/**
 * The values of a short range, to go on editing as a list.
 *
 * @param {Values} range
 * @returns {number[]|null}
 */
export function listOf({ start, stop, step }) {
  if (typeof start !== "number" || typeof stop !== "number" || typeof step !== "number" || step === 0) return null;
  const count = Math.floor((stop - start) / step + 1e-9) + 1;
  if (!(count >= 1 && count <= LONGEST_LIST)) return null;
  return Array.from({ length: count }, (_, index) => Number((start + index * step).toPrecision(10)));
}
