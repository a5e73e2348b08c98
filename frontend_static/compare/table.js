/** The table beside the pictures: what differs between the runs, only that, and what came of them. */

import { fill, h, setText } from "../shared/dom.js";
import { count } from "../shared/format.js";
import { outcomeLines } from "./outcome_text.js";

/** @import { Setting } from "../shared/messages.js" */
/** @import { Outcome, Outline } from "./compare.js" */

const INTERVAL =
  "An error that is large in one frame is large in the next: the frames of one run are not independent trials. Therefore the frames in " +
  "common are divided into six blocks, and the interval is that of the block means (batch means). It is about these runs with " +
  "these seeds; for other seeds, run a sweep.";

export class Table {
  #comparison;
  #shown = "";
  #outcomes = h("tbody", {});
  #progress = h("p", { class: "hint", role: "status" });
  /** Wherever the pictures stand, the figures are not what has come of the runs so far. */
  #over = h("p", { class: "hint over", hidden: true });
  #why = h("details", { class: "hint", hidden: true }, h("summary", {}, "What the interval means"), h("p", {}, INTERVAL));

  /** @param {Outline} comparison */
  constructor(comparison) {
    this.#comparison = comparison;
    const { runs, settings } = comparison;
    const isShort = runs.length > 2;
    this.element = h(
      "section",
      { class: "comparison-table", "aria-label": "What differs" },
      h(
        "table",
        {},
        h("thead", {}, h("tr", {}, h("td", {}), runs.map(({ name, colour }, place) => head(name, colour, place)))),
        h("tbody", {}, settings.map((setting) => settingRow(setting, isShort))),
        this.#outcomes,
      ),
      this.#over,
      settings.length === 0 && h("p", { class: "hint" }, "The runs have identical settings."),
      this.#progress,
      this.#why,
    );
  }

  /**
   * Say how far it is, and what came of the runs as soon as that is known.
   *
   * @param {Outcome} outcome
   * @param {string} measure Title of what decides on success; the lines come when it is known.
   */
  show({ state, done, total, result, error }, measure) {
    const { unit, runs } = this.#comparison;
    fill(this.#progress, wordsOf(state, done, total, error));
    this.#progress.hidden = state === "done";
    this.#progress.classList.toggle("wrong", state === "failed");
    const now = `${measure} ${state}`;
    if (result === null || measure === "" || now === this.#shown) return;
    this.#shown = now;
    const lines = outcomeLines(result, { unit, names: runs.map(({ name }) => name), measure });
    fill(this.#outcomes, lines.map(({ title, hint, cells }) => h("tr", {}, h("th", { scope: "row", title: hint }, title), cells.map(figure))));
    setText(this.#over, `Over all ${count(result.frames, "frame")} in common.`);
    this.#over.hidden = lines.length === 0;
    this.#why.hidden = result.paired.every(({ low }) => low === null);
  }
}

/**
 * @param {string} state
 * @param {number} done
 * @param {number} total
 * @param {string|null} error
 */
function wordsOf(state, done, total, error) {
  if (state === "failed") return `The results are not available: ${error}`;
  if (total === 0) return "The results are computed as soon as the server has a free place";
  return `Computing the results, ${done} of ${count(total, "frame")}`;
}

/**
 * @param {string} name
 * @param {string} colour
 * @param {number} place
 */
function head(name, colour, place) {
  const swatch = h("span", { class: "swatch" });
  swatch.style.background = colour;
  return h("th", { scope: "col", title: name, "aria-label": name }, swatch, h("span", { "aria-hidden": "true" }, String(place + 1)));
}

/**
 * @param {Setting} setting
 * @param {boolean} isShort Whether there is little room: a name has a short form in brackets.
 */
function settingRow({ name, title, values }, isShort) {
  const words = (/** @type {string} */ value) => (isShort && name === "tracker" ? value.replaceAll(/[^,(]*\(([^)]+)\)/g, "$1") : value);
  const cells = values.map((value) => (value === null ? h("td", { title: "This run has no such setting" }, "–") : h("td", { title: value }, words(value))));
  return h("tr", { data: { setting: name } }, h("th", { scope: "row" }, title), cells);
}

/** @param {import("./outcome_text.js").Cell} cell */
function figure({ text, more, hint }) {
  return h("td", { title: hint, class: "figure" }, text, more && h("span", { class: "hint" }, more));
}
