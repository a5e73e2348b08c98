/** The question of a lesson: it is asked first; then it says how far off the answer was, and why. */

import { messageOf } from "../shared/api.js";
import { fill, h } from "../shared/dom.js";
import { isParticipant } from "../shared/participant.js";
import { htmlElement } from "./html_text.js";
import { figure } from "./number_text.js";

/** @import { LessonDetail, QuestionPublic, VerdictPublic } from "../shared/messages.js" */
/** @import { Child } from "../shared/elements.js" */

/**
 * @typedef {object} Listener
 * @property {(given: number|string) => Promise<void>} answer
 * @property {() => void} skip
 * @property {() => void} again
 * @property {() => void} toClass Ask the class instead.
 */

const HINTS = {
  number: "Your prediction, a number",
  choice: "Your prediction",
  point: "Place your prediction in the figure: click, or use the arrow keys there.",
};

const WAITING = "Answer or skip the question to use the controls.";

export class Question {
  #place;
  #question;
  #next;
  #on;
  /** @type {number|null} */
  #placed = null;
  #said = h("p", { class: "question-said", role: "alert" });
  #spot = h("output", { class: "question-spot" });
  #toClass = h("button", { type: "button", hidden: true, title: "As a poll: its answers are chosen by a tap", data: { role: "to-class" } }, "Ask the class");

  /**
   * @param {HTMLElement} place
   * @param {LessonDetail} lesson
   * @param {Listener} on
   */
  constructor(place, { question, next }, on) {
    this.#place = place;
    this.#question = question;
    this.#next = next;
    this.#on = on;
    this.#toClass.addEventListener("click", () => on.toClass());
  }

  /** @param {boolean} isLed Whether there is a class that sees the lesson. */
  offerClass(isLed) {
    this.#toClass.hidden = !isLed;
  }

  /** Ask. */
  ask() {
    this.#placed = null;
    this.#tell("");
    fill(this.#spot, "nowhere yet");
    const show = h("button", { type: "submit", class: "primary" }, "Show");
    const skip = h("button", { type: "button", class: "quiet", on: { click: () => this.#on.skip() } }, "Skip");
    const form = h(
      "form",
      { class: "question", novalidate: true, on: { submit: (event) => this.#submit(event, show) } },
      h("div", {}, h("h2", {}, "Predict, then see"), h("p", { class: "hint" }, WAITING)),
      htmlElement("p", this.#question.text, { class: "question-text", id: "question" }),
      h("div", { class: "question-line answering" }, input(this.#question, this.#spot), show, skip, this.#toClass),
      this.#said,
    );
    this.#show("asked", form);
  }

  /**
   * Take note of where a prediction was placed.
   *
   * @param {number} value On the axis that counts.
   */
  placed(value) {
    this.#placed = value;
    fill(this.#spot, `at ${figure(value, 3, this.#question.unit)}`);
    this.#tell("");
  }

  /**
   * Say how far the run is by which the answer is judged.
   *
   * @param {number} done
   * @param {number} total
   */
  computing(done, total) {
    this.#tell(total > 0 ? `Computing the run that gives the answer: frame ${done} of ${total}.` : "Computing the run that gives the answer.", false);
  }

  /** @param {VerdictPublic} verdict */
  say({ right, words }) {
    const title = right ? "✓ Right" : "✗ Not quite";
    const reason = h("div", { class: "verdict-words" }, words.map((sentence) => htmlElement("span", sentence)).flatMap((span) => [span, " "]));
    this.#show(right ? "right" : "wrong", this.#past(title, reason, "Ask me again"));
  }

  /** Say that it was not answered. */
  skipped() {
    this.#unjudged("Skipped", "You skipped the prediction. The figure now shows the answer.");
  }

  /** Say that a class has answered it. */
  answeredByClass() {
    this.#unjudged("The class has answered", "The figure now shows the answer.");
  }

  /**
   * @param {string} title
   * @param {string} sentence
   */
  #unjudged(title, sentence) {
    this.#show("skipped", this.#past(title, h("p", { class: "verdict-words" }, sentence), "Ask me"));
  }

  /**
   * What stands there once it is not asked any more.
   *
   * @param {string} title
   * @param {HTMLElement} words
   * @param {string} again
   */
  #past(title, words, again) {
    const text = htmlElement("p", this.#question.text, { class: "question-text" });
    return h("div", { class: "question", role: "status" }, h("h2", {}, title), text, words, this.#ways(again));
  }

  /** @param {string} label */
  #ways(label) {
    const next = this.#next;
    const href = next && `learn/${encodeURIComponent(next.id)}`;
    const onward = next && h("a", { class: "button primary", data: { role: "next-lesson" }, href }, `Next: ${next.title}`);
    return h(
      "div",
      { class: "question-line" },
      h("button", { type: "button", on: { click: () => this.#on.again() } }, label),
      this.#toClass,
      onward ?? (!isParticipant && h("a", { class: "button", href: "learn" }, "All lessons")),
    );
  }

  /**
   * @param {SubmitEvent} event
   * @param {HTMLButtonElement} show
   */
  async #submit(event, show) {
    event.preventDefault();
    const given = this.#given(/** @type {HTMLFormElement} */ (event.currentTarget));
    if (given === null) return;
    show.disabled = true;
    this.#tell("");
    try {
      await this.#on.answer(given);
    } catch (error) {
      // What is refused begins with the name of the field.
      this.#tell(messageOf(error).replace(/^answer /, "Your answer "));
    } finally {
      show.disabled = false;
    }
  }

  /**
   * @param {HTMLFormElement} form
   * @returns {number|string|null} Null where there is none, which is said.
   */
  #given(form) {
    const { kind } = this.#question;
    if (kind === "point") {
      if (this.#placed === null) this.#tell("Place your prediction in the figure first, or skip the question.");
      return this.#placed;
    }
    const given = String(new FormData(form).get("answer") ?? "");
    if (given.trim() === "") {
      this.#tell(`${kind === "choice" ? "Choose one of the answers" : "Type a number"} first, or skip the question.`);
      return null;
    }
    // The server reads a number as people type it, and says what it takes.
    return given;
  }

  /**
   * @param {string} words
   * @param {boolean} [isWrong]
   */
  #tell(words, isWrong = true) {
    fill(this.#said, words);
    this.#said.classList.toggle("wrong", isWrong);
    this.#said.hidden = words === "";
  }

  /**
   * @param {string} stage
   * @param {Child} content
   */
  #show(stage, content) {
    this.#place.dataset.stage = stage;
    fill(this.#place, content);
  }
}

/**
 * @param {QuestionPublic} question
 * @param {HTMLElement} spot
 * @returns {Child}
 */
function input({ kind, unit, choices }, spot) {
  const described = { "aria-describedby": "question", "aria-label": HINTS[kind] };
  switch (kind) {
    case "number":
      return [
        h("input", { type: "text", class: "question-number", inputmode: "decimal", name: "answer", autocomplete: "off", ...described }),
        unit && h("span", {}, unit),
      ];
    case "choice":
      return h(
        "div",
        { class: "question-choices", role: "radiogroup", ...described },
        choices.map(({ name, words }) =>
          h("label", { class: "question-choice" }, h("input", { type: "radio", name: "answer", value: name }), htmlElement("span", words)),
        ),
      );
    default:
      return [h("span", { class: "hint" }, HINTS.point), spot];
  }
}
