/** The numbers of a figure: the one that counts large, each with its exact value and whether it is as close as it should be. */

import { fill, h } from "../shared/dom.js";
import { beside, figure } from "./number_text.js";

/** @import { Number as LessonNumber } from "../shared/messages.js" */

/**
 * @param {HTMLElement} place
 * @param {readonly LessonNumber[]} numbers
 */
export function showNumbers(place, numbers) {
  fill(place, numbers.map(one));
}

/**
 * @param {LessonNumber} number
 * @param {number} index
 */
function one(number, index) {
  const { title, value, digits, unit, within } = number;
  return h(
    "div",
    { class: index === 0 ? "lesson-number first" : "lesson-number" },
    h("output", { "aria-label": title }, figure(value, digits, unit)),
    h("span", { class: "lesson-number-words" }, h("span", {}, title), h("span", { class: "hint" }, beside(number), within !== null && mark(within))),
  );
}

/** @param {boolean} within */
export function mark(within) {
  return h("span", { class: within ? "tick" : "cross", "aria-hidden": "true" }, within ? " ✓" : " ✗");
}
