/** A line of what would have saved a run: the change in words, the share of runs that hold, its cost, and what it may be called. */

import { h, setText } from "../../shared/dom.js";
import { number } from "../../shared/format.js";

/** @import { ToldFinding } from "../../shared/messages.js" */

const LEAST_P = 0.001;
const WORDS = { baseline: "", better: "better than no change", worse: "worse than no change", unclear: "not clearly better" };

export class Line {
  #title = h("span", { class: "what-if-title" });
  #share = h("i", { class: "share" });
  #interval = h("i", { class: "interval" });
  #bar = h("span", { class: "share-bar", role: "img" }, this.#share, this.#interval);
  #count = h("span", { class: "what-if-count" });
  #said = h("span", { class: "what-if-said" });
  #sweep = h("a", { class: "link", title: "Vary this in a sweep, over many scenes and seeds" }, "Sweep");
  #open = h("button", { type: "button" }, "Open");
  element;

  /** @param {() => void} open */
  constructor(open) {
    this.#open.addEventListener("click", open);
    this.element = h(
      "li",
      {},
      this.#title,
      h("span", { class: "what-if-result" }, this.#bar, this.#count),
      h("span", { class: "what-if-tools" }, this.#said, this.#sweep, this.#open),
    );
  }

  /**
   * @param {ToldFinding} finding
   * @param {string} sweep Where its sweep is; "" if it has none.
   */
  show(finding, sweep) {
    const { title, holding, runs, share, low, high, step_ms: cost, verdict, corrected } = finding;
    setText(this.#title, title);
    setText(this.#count, `${holding} of ${runs} hold`);
    const percent = (/** @type {number|null} */ value) => `${number(100 * (value ?? 0), 0)}%`;
    this.#share.style.width = percent(share);
    this.#interval.style.left = percent(low);
    this.#interval.style.width = percent((high ?? 0) - (low ?? 0));
    this.#bar.setAttribute("aria-label", `${percent(share)} of the runs hold; 95 % interval ${percent(low)} to ${percent(high)}`);
    this.#bar.title = `95 % interval ${percent(low)} to ${percent(high)}`;
    const said = corrected === null ? WORDS[verdict] : `${WORDS[verdict]}, ${inWords(corrected)}`;
    setText(this.#said, [said, `${number(cost, cost < 1 ? 2 : 1)} ms a step`].filter(Boolean).join(" · "));
    this.#open.title = `Open "${title}" as a branch with the seed ${finding.seed}`;
    this.#open.setAttribute("aria-label", this.#open.title);
    this.#open.disabled = finding.seed === null;
    this.#sweep.hidden = sweep === "";
    if (sweep !== "") this.#sweep.href = sweep;
    this.element.dataset.verdict = verdict;
  }
}

/** @param {number} corrected */
function inWords(corrected) {
  return corrected < LEAST_P ? `p\u00a0<\u00a0${LEAST_P}` : `p\u00a0=\u00a0${Number(corrected.toPrecision(2))}`;
}
