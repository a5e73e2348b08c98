/** Before a class begins: what it is, how many may come, and the classes that there are already. */

import { fill, h } from "../shared/dom.js";
import { follows } from "./api.js";
import { following } from "./text.js";

/** @import { ClassControl } from "./class_control.js" */

const WHAT =
  "Whoever opens a short link sees what you show here: the same frame, the same parameters, read only. " +
  "No name is asked for. Of polls it is kept how many gave which answer.";
const MOST_FOLLOWERS = 200;

/**
 * @param {ClassControl} control
 * @param {AbortSignal} signal
 */
export function beginForm(control, signal) {
  const followers = amount(MOST_FOLLOWERS);
  const go = h("button", { type: "submit", class: "primary", autofocus: true }, "Begin");
  const begin = async (/** @type {SubmitEvent} */ event) => {
    event.preventDefault();
    go.disabled = true;
    await control.begin(followers.valueAsNumber);
    go.disabled = false;
  };
  const others = h("ul", { class: "class-others", "aria-label": "Running classes", hidden: true });
  offer(others, control, signal);
  return [
    h(
      "form",
      { novalidate: true, on: { submit: begin } },
      h("p", {}, WHAT),
      h("div", { class: "class-limits" }, limit(followers)),
      h("footer", {}, go),
    ),
    others,
  ];
}

/** @param {HTMLInputElement} field */
export function limit(field) {
  return h("label", { class: "class-limit" }, h("span", {}, "Most followers"), field);
}

/** @param {number} value */
export function amount(value) {
  return h("input", { type: "number", value, min: 0, max: 1000, step: 1, inputmode: "numeric" });
}

/**
 * Offer to lead a class that was begun on another page.
 *
 * @param {HTMLElement} place
 * @param {ClassControl} control
 * @param {AbortSignal} signal
 */
async function offer(place, control, signal) {
  const all = await follows.all().catch(() => []);
  if (signal.aborted || all.length === 0) return;
  place.hidden = false;
  fill(
    place,
    all.map((follow) =>
      h(
        "li",
        { class: "row" },
        h("span", { class: "row-words" }, h("span", { class: "row-title" }, follow.title), h("span", { class: "hint" }, following(follow.followers))),
        h("button", { type: "button", class: "row-actions", on: { click: () => control.show(follow) } }, "Show this page to it"),
      ),
    ),
  );
}
