/** One of the two runs of a failure: what is said of it, and a place for its picture. */

import { fill, h } from "../shared/dom.js";
import { linkTo } from "../shared/share_link.js";
import { tokens } from "../shared/theme.js";
import { settings } from "./difference_text.js";

/** @import { FailureResult, FailurePublic } from "../shared/messages.js" */
/** @typedef {"failing"|"cured"} Side */

const HEADS = { failing: "Fails", cured: "Cured" };
/** As in the gallery's curves. */
const COLOURS = /** @type {const} */ ({ failing: "lost", cured: "second" });

/**
 * @typedef {object} Column
 * @property {HTMLElement} element
 * @property {HTMLElement} place For the picture.
 * @property {Side} side
 * @property {string} name
 * @property {string} setting What it has of what differs.
 * @property {string} colour As CSS has it.
 * @property {(course: FailureResult) => void} show Say what was measured.
 * @property {(sentence: string) => void} tell Say something in its place.
 */

/**
 * @param {FailurePublic} failure
 * @param {Side} side
 * @returns {Column}
 */
export function column(failure, side) {
  const setting = settings(failure, side);
  const colour = tokens(COLOURS[side])[COLOURS[side]];
  const place = h("div", { class: "failure-view" });
  const measured = h("p", { class: "measured", role: "status" }, h("span", { class: "bone shimmer" }));
  const element = h(
    "section",
    { class: "failure-column", "aria-label": HEADS[side], data: { side } },
    h(
      "div",
      { class: "failure-words" },
      h(
        "h2",
        {},
        h("span", { class: "failure-verdict" }, HEADS[side]),
        h("span", { class: "failure-setting" }, setting),
        h("a", { class: "link", href: linkTo({ recipe: failure[side], position: failure.frame }) }, "Open as a session"),
      ),
      h("p", {}, side === "failing" ? failure.diagnosis : failure.cure),
      measured,
    ),
    place,
  );
  const tell = (/** @type {string} */ sentence) => fill(measured, sentence);
  return { element, place, side, name: HEADS[side], setting, colour, tell, show: (course) => fill(measured, ...told(course[side])) };
}

/**
 * What was measured in a run, and why it was lost where it was.
 *
 * @param {FailureResult[Side]} run
 */
function told({ finding, why, lost }) {
  return [finding, lost.at(-1) && h("span", { class: "why" }, ` By its numbers alone: ${why}`)];
}
