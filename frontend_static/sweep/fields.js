/** Fields of a plan: inputs by the kind of a parameter, and errors beside the field that they are about. */

import { fill, h } from "../shared/dom.js";

/** @import { ApiError } from "../shared/api.js" */
/** @import { Value } from "../shared/format.js" */
/** @import { Declaration } from "../shared/messages.js" */

/**
 * A labelled field with a place for its error.
 *
 * @param {string} name By which the server names it.
 * @param {string} title
 * @param {HTMLElement} input
 */
export function field(name, title, input) {
  return h("label", { class: "field", data: { field: name } }, h("span", {}, title), input, wrong());
}

/** Where an error will be written. */
export function wrong() {
  return h("p", { class: "wrong", role: "alert", hidden: true });
}

/**
 * Choose a parameter, under the headings of its group.
 *
 * @param {string} label
 * @param {Declaration[]} declarations
 * @param {string} chosen
 * @param {(name: string) => void} choose
 */
export function parameterSelect(label, declarations, chosen, choose) {
  /** @type {Map<string, Declaration[]>} */
  const groups = new Map();
  // What is done in the course of a run, files, and what is only drawn are nothing to vary or to fix.
  const values = declarations.filter(
    ({ kind, role, name }) => kind !== "file" && (role !== "drawing" || name === chosen),
  );
  for (const declaration of values) groups.set(declaration.group, [...(groups.get(declaration.group) ?? []), declaration]);
  const option = (/** @type {Declaration} */ { name, title, unit }) =>
    h("option", { value: name, selected: name === chosen }, unit ? `${title}, ${unit}` : title);
  const list = h(
    "select",
    { "aria-label": label },
    [...groups].map(([group, members]) => (group ? h("optgroup", { label: group }, members.map(option)) : members.map(option))),
  );
  list.addEventListener("change", () => choose(list.value));
  return list;
}

/**
 * An input for one value of a parameter.
 *
 * @param {Declaration} declaration
 * @param {unknown} value The default if undefined.
 * @param {() => void} changed
 * @returns {{element: HTMLElement, read: () => Value|null}}
 */
export function valueInput(declaration, value, changed) {
  const { kind, title, minimum: min, maximum: max, step, unit, choices } = declaration;
  const given = String(value ?? declaration.default);
  if (kind === "choice" || kind === "boolean") {
    const options = (kind === "choice" ? choices : ["true", "false"]).map((option) => h("option", { value: option, selected: option === given }, option));
    const input = h("select", { "aria-label": title, on: { change: changed } }, options);
    return { element: input, read: () => (kind === "boolean" ? input.value === "true" : input.value) };
  }
  if (kind === "colour") {
    const input = h("input", { type: "text", value: given, "aria-label": title, on: { input: changed } });
    return { element: input, read: () => input.value.trim() };
  }
  const input = h("input", { type: "number", value: given, min, max, step: step ?? "any", "aria-label": title, on: { input: changed } });
  const element = h("span", { class: "axis-values" }, input, unit, h("span", { class: "hint" }, bounds(declaration)));
  return { element, read: () => numberOf(input) };
}

/**
 * "0 to 640 px"
 *
 * @param {Declaration} declaration
 */
function bounds({ minimum, maximum, unit }) {
  if (minimum === null || maximum === null) return "";
  return `${minimum} to ${maximum.toLocaleString("en-GB")}${unit ? ` ${unit}` : ""}`;
}

/**
 * "Allowed 0 to 640 px."
 *
 * @param {Declaration} declaration
 */
export function allowed(declaration) {
  const words = bounds(declaration);
  return words && `Allowed ${words}.`;
}

/**
 * What is in a number field; null when it is empty.
 *
 * @param {HTMLInputElement} input
 */
export function numberOf(input) {
  return input.value.trim() === "" ? null : Number(input.value);
}

/**
 * Take all errors away.
 *
 * @param {HTMLFormElement} form
 */
export function clearErrors(form) {
  for (const place of form.querySelectorAll(".wrong")) place.toggleAttribute("hidden", true);
  for (const input of form.querySelectorAll('[aria-invalid="true"]')) input.removeAttribute("aria-invalid");
}

/**
 * Write an error beside the field that it names, or beside the nearest one around it.
 *
 * @param {HTMLFormElement} form
 * @param {ApiError} error
 * @returns {boolean} Whether there is such a field.
 */
export function showError(form, error) {
  clearErrors(form);
  const parts = (error.field ?? "").split(".");
  for (let length = parts.length; length > 0; length -= 1) {
    const place = form.querySelector(`[data-field="${CSS.escape(parts.slice(0, length).join("."))}"]`);
    if (place === null) continue;
    const around = place.querySelector(".wrong") ? place : place.closest("[data-field]:has(.wrong)") ?? place.parentElement?.closest(":has(.wrong)");
    const words = around?.querySelector(".wrong");
    if (!words) continue;
    words.toggleAttribute("hidden", false);
    fill(words, sentence(error));
    const isOwn = length > 1 && length === parts.length;
    const input = place.matches("input, select") ? place : isOwn && place.querySelector("input, select");
    if (input) input.setAttribute("aria-invalid", "true");
    return true;
  }
  return false;
}

/**
 * An error's words without the name of its field in the code.
 *
 * @param {ApiError} error
 */
function sentence({ field: name, message }) {
  const words = name && message.startsWith(`${name}: `) ? message.slice(name.length + 2) : message;
  return words.slice(0, 1).toUpperCase() + words.slice(1);
}
