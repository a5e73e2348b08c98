/** One of the two runs of a failure: what is said of it, and a place for its picture. */

import { fill, h } from "../shared/dom.js";
import { quantity } from "../shared/format.js";
import { linkTo } from "../shared/share_link.js";
import { tokens } from "../shared/theme.js";
import { settings, withUnit } from "./difference_text.js";

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
  const numbers = h("div", { class: "failure-numbers" });
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
      numbers,
    ),
    place,
  );
  const tell = (/** @type {string} */ sentence) => fill(measured, sentence);
  const show = (/** @type {FailureResult} */ course) => {
    fill(measured, told(course[side]));
    fill(numbers, ...numbersOf(course, side));
  };
  return { element, place, side, name: HEADS[side], setting, colour, tell, show };
}

/**
 * Why a run is lost where it stays so, and what was found in its numbers.
 *
 * @param {FailureResult[Side]} run
 */
function told({ finding, why, lost }) {
  return lost.at(-1) ? [h("strong", {}, why), ` ${finding}`] : finding;
}

/**
 * What shows the failure, as it is in one of the runs from the loss on.
 *
 * @param {FailureResult} course
 * @param {Side} side
 */
function numbersOf({ frame, measured }, side) {
  const words = (/** @type {FailureResult["measured"][number]} */ it) => withUnit(quantity(it[side], it.unit), it.unit);
  const terms = measured.map((it) => h("div", {}, h("dt", {}, it.title), h("dd", {}, words(it))));
  return measured.length ? [h("p", { class: "hint" }, `From frame ${frame} on`), h("dl", {}, terms)] : [];
}
