/** Before a class begins: what it is, how many may come, and the classes that there are already. */

import { fill, h } from "../shared/dom.js";
import { follows } from "./api.js";
import { following } from "./text.js";

/** @import { ClassControl, Limits } from "./class_control.js" */

const WHAT =
  "Whoever opens a short link sees what you show here: the same frame, the same parameters, read only. " +
  "No name is asked for. Of polls it is kept how many gave which answer.";
/** @type {Limits} */
const FIRST = { most_followers: 200, most_forks: 4 };

/**
 * @param {ClassControl} control
 * @param {AbortSignal} signal
 */
export function beginForm(control, signal) {
  const followers = amount(FIRST.most_followers, 1);
  const forks = amount(FIRST.most_forks, 0);
  const go = h("button", { type: "submit", class: "primary", autofocus: true }, "Begin");
  const begin = async (/** @type {SubmitEvent} */ event) => {
    event.preventDefault();
    go.disabled = true;
    await control.begin({ most_followers: followers.valueAsNumber, most_forks: forks.valueAsNumber });
    go.disabled = false;
  };
  const others = h("ul", { class: "class-others", "aria-label": "Running classes", hidden: true });
  offer(others, control, signal);
  return [
    h(
      "form",
      { novalidate: true, on: { submit: begin } },
      h("p", {}, WHAT),
      h(
        "div",
        { class: "class-limits" },
        limit("Most followers", followers),
        limit("Most own copies at one time", forks),
      ),
      h("footer", {}, go),
    ),
    others,
  ];
}

/**
 * @param {string} words
 * @param {HTMLInputElement} field
 */
export function limit(words, field) {
  return h("label", { class: "class-limit" }, h("span", {}, words), field);
}

/**
 * @param {number} value
 * @param {number} min
 */
export function amount(value, min) {
  return h("input", { type: "number", value, min, max: 1000, step: 1, inputmode: "numeric" });
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
