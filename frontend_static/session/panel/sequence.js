/** The control of a sequence: a button for each step, which appends it, and two that take steps back. */

import { fill, h } from "../../shared/dom.js";

/** @import { ControlPublic, Declaration } from "../../shared/messages.js" */
/** @import { Control } from "./control.js" */

/** Newest steps that are named; the number of all stands before them. */
const NAMED = 2;

/**
 * @param {Declaration} declaration
 * @param {ControlPublic} turning
 * @param {(value: string) => void} propose
 * @returns {Control}
 */
export function sequence(declaration, { label, hint }, propose) {
  let steps = "";
  const isFull = () => steps.length >= (declaration.maximum ?? Infinity);
  const said = h("output", { class: "sequence-steps" });
  const show = (/** @type {string} */ value) => {
    steps = value;
    fill(said, inWords(steps, declaration.sequence));
    for (const button of [undo, again]) button.setAttribute("aria-disabled", String(steps === ""));
    for (const button of letters) button.setAttribute("aria-disabled", String(isFull()));
  };
  // What is proposed counts at once, so that the next press appends to it and not to what the server said last.
  const turn = (/** @type {string} */ value) => {
    if (value === steps) return;
    show(value);
    propose(value);
  };
  const button = (/** @type {string} */ title, /** @type {string} */ key, /** @type {() => string} */ next) =>
    h("button", { type: "button", "aria-keyshortcuts": key, on: { click: () => turn(next()) } }, title);
  const letters = Object.entries(declaration.sequence).map(([letter, title]) => button(title, letter, () => (isFull() ? steps : steps + letter)));
  // Never disabled, which would take the focus from whoever presses it for the last time.
  const undo = button("Undo", "Backspace", () => steps.slice(0, -1));
  const again = button("Start again", "Delete", () => "");
  const element = h(
    "div",
    { class: "control sequence-control", role: "group", "aria-label": label, "aria-description": hint, title: hint },
    h("div", { class: "sequence-title" }, h("span", {}, label), said),
    h("div", { class: "sequence-buttons" }, letters, undo, again),
  );
  element.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const pressed = [...letters, undo, again].find((each) => each.getAttribute("aria-keyshortcuts") === event.key);
    if (pressed === undefined) return;
    event.preventDefault();
    event.stopPropagation(); // the letter may be a key of the page
    pressed.click();
  });
  show(steps);
  return { element, show: (value) => show(String(value)) };
}

/**
 * "12 steps: … predict, measure"
 *
 * @param {string} steps
 * @param {Record<string, string>} titles
 */
export function inWords(steps, titles) {
  if (steps === "") return "nothing yet";
  const newest = [...steps].slice(-NAMED).map((letter) => (titles[letter] ?? letter).toLowerCase());
  const count = steps.length === 1 ? "1 step" : `${steps.length} steps`;
  return `${count}: ${steps.length > NAMED ? "… " : ""}${newest.join(", ")}`;
}
