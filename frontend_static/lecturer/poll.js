/**
 * A poll as everybody sees it: the question with its answers, and, once these are revealed, a bar for each, with its figures
 * beside it and a sentence below.
 */

import { fill, h, setText } from "../shared/dom.js";
import { pollWords } from "./text.js";

/** @import { Child } from "../shared/elements.js" */
/** @import { PollPublic } from "../shared/messages.js" */

/**
 * @typedef {object} Options
 * @property {((answer: number) => void)|null} vote Called with what is answered; null where nobody is asked.
 * @property {Child} [tools] What can be done with the poll as a whole.
 */

/** Letters from which on a question takes several lines where it is presented. */
const LONG = 90;

export class PollView {
  #question = h("h2", {});
  #answers = h("ol", { class: "poll-answers" });
  #said = h("p", { class: "hint", role: "status" });
  #vote;
  #made = "";

  element = h("section", { class: "poll", "aria-label": "Poll" });

  /** @param {Options} options */
  constructor({ vote, tools }) {
    this.#vote = vote;
    fill(this.element, this.#question, this.#answers, h("div", { class: "poll-line" }, this.#said, tools));
  }

  /**
   * @param {PollPublic} poll
   * @param {{own?: number|null, followers?: number}} [beside] Which answer is one's own, and how many are asked, where that is known.
   */
  show(poll, { own = null, followers } = {}) {
    setText(this.#question, poll.question);
    // What is about to be pressed must not be exchanged under the finger.
    const made = JSON.stringify([poll.id, poll.counts, this.#vote === null ? null : own]);
    if (made !== this.#made) {
      const held = this.element.contains(document.activeElement) ? document.activeElement?.getAttribute("data-answer") : null;
      this.#made = made;
      fill(this.#answers, poll.answers.map((text, place) => h("li", {}, poll.counts === null ? this.#asked(text, place, own) : bar(poll, place, own))));
      const again = held && this.#answers.querySelector(`[data-answer="${held}"]`);
      if (again instanceof HTMLElement) again.focus();
    }
    this.element.toggleAttribute("data-revealed", poll.counts !== null);
    this.element.toggleAttribute("data-long", poll.question.length > LONG);
    setText(this.#said, pollWords(poll, { own, followers, asks: this.#vote !== null }));
  }

  /**
   * @param {string} text
   * @param {number} place
   * @param {number|null} own
   */
  #asked(text, place, own) {
    const content = [h("span", { class: "poll-place", "aria-hidden": "true" }, own === place ? "✓" : place + 1), h("span", {}, text)];
    const vote = this.#vote;
    if (vote === null) return h("div", { class: "poll-answer" }, content);
    const pressed = String(own === place);
    return h("button", { type: "button", class: "poll-answer", "aria-pressed": pressed, data: { answer: place }, on: { click: () => vote(place) } }, content);
  }
}

/**
 * @param {PollPublic} poll
 * @param {number} place
 * @param {number|null} own
 */
function bar({ answers, counts }, place, own) {
  const all = counts ?? [];
  const votes = all.reduce((sum, each) => sum + each, 0);
  const share = votes === 0 ? 0 : all[place] / votes;
  return h(
    "div",
    { class: "poll-bar" },
    h("span", { class: "poll-text" }, answers[place], own === place && h("span", { class: "poll-own" }, " · your answer")),
    h("span", { class: "poll-count" }, `${all[place]} · ${Math.round(100 * share)} %`),
    h("span", { class: "poll-track", "aria-hidden": "true" }, h("i", { style: `width: ${100 * share}%` })),
  );
}
