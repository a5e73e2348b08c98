/** The course of a lesson: first the question, then the answer; then all controls are unlocked. */

import { messageOf, request } from "../shared/api.js";
import { after } from "../shared/timing.js";
import { isParticipant } from "../shared/visitor.js";
import { h, html, signal, useSignal } from "../vendor/preact.js";
import { figure } from "./numbers.js";
import { Progress } from "./progress.js";
import { Demonstration, LessonRun } from "./stage.js";

/** @import { LessonDetail, LessonPublic, QuestionPublic, VerdictPublic } from "../shared/messages.js" */
/** @import { Child } from "../vendor/preact.js" */
/** @import { Answer } from "./stage.js" */

const AGAIN_MS = 300;
const WAITING = "Answer or skip the question to use the controls.";
/** The name of the field, by kind of question. */
const HINTS = {
  number: "Your prediction, a number",
  choice: "Your prediction",
  point: "Place your prediction in the figure: click, or use the arrow keys there.",
};
/** Message for a missing answer. */
const FIRST = { number: "Type a number", choice: "Choose one of the answers", point: "Place your prediction in the figure" };
const UNJUDGED = {
  skipped: ["Skipped", "You skipped the prediction. The figure now shows the answer."],
  class: ["The class has answered", "The figure now shows the answer."],
};

/** HTML that the server made from Markdown and formulas; it escapes HTML in the source. @param {string} text */
export const written = (text) => ({ dangerouslySetInnerHTML: { __html: text } });

/** The state of a lesson's page: the answer to its question, and its figure or run. */
export class Course {
  progress = new Progress();
  answer = signal(/** @type {Answer} */ (null));
  /** The message below the question. */
  said = signal({ words: "", isWrong: true });
  /** @type {import("../vendor/preact.js").Signal<number|null>} The placed prediction, as a value on the question's axis. */
  placed = signal(/** @type {number|null} */ (null));
  /** @type {import("../vendor/preact.js").Signal<(() => void)|null>} Asks a class the question, if a class follows the lesson. */
  askClass = signal(/** @type {(() => void)|null} */ (null));
  /** The run that uses the idea, if it is shown in place of the figure. */
  used = signal(/** @type {LessonRun|null} */ (null));

  /**
   * @param {LessonDetail} lesson
   * @param {LessonPublic[]} all
   */
  constructor(lesson, all) {
    this.lesson = lesson;
    this.all = all.filter(({ number }) => number > 0);
    const placed = (/** @type {number} */ value) => {
      this.placed.value = value;
      this.say("");
    };
    this.stage = lesson.scenario ? new LessonRun(lesson.scenario) : new Demonstration(lesson, this.answer, placed);
    const entry = this.progress.of(lesson.id);
    if (entry !== null && "skipped" in entry) this.answer.value = "skipped";
    // The stored answer may be to an earlier version of the question.
    else if (entry !== null) this.#judged(entry.given).then((verdict) => this.#reveal(verdict), () => {});
  }

  /** The run shown in place of a figure. */
  get run() {
    return this.used.value ?? (this.stage instanceof LessonRun ? this.stage : null);
  }

  /**
   * @param {string} words
   * @param {boolean} [isWrong]
   */
  say(words, isWrong = true) {
    this.said.value = { words, isWrong };
  }

  /** @param {number|string} given */
  async judge(given) {
    this.say("");
    try {
      const verdict = await this.#judged(given);
      this.#reveal(verdict);
      if (this.stage instanceof LessonRun && verdict.frame !== null) this.stage.playTo(verdict.frame);
    } catch (error) {
      this.say(messageOf(error).replace(/^answer /, "Your answer "));
    }
  }

  skip() {
    this.progress.set(this.lesson.id, { skipped: true });
    this.answer.value = "skipped";
  }

  again() {
    this.progress.set(this.lesson.id, null);
    this.placed.value = null;
    this.say("");
    this.answer.value = null;
  }

  /** @param {VerdictPublic} verdict */
  #reveal(verdict) {
    this.progress.set(this.lesson.id, { given: verdict.given, right: verdict.right });
    this.answer.value = verdict;
  }

  /** Request a verdict on an answer, and wait for the run that decides on it.
   *
   * @param {number|string} given
   * @returns {Promise<VerdictPublic>}
   */
  async #judged(given) {
    for (;;) {
      const said = await request("POST lessons/{lesson}/answer", { lesson: this.lesson.id, body: { answer: given } });
      if ("words" in said) return said;
      const far = said.total > 0 ? `: frame ${said.done} of ${said.total}.` : ".";
      this.say(`Computing the run that gives the answer${far}`, false);
      await after(AGAIN_MS);
    }
  }
}

/** @param {{course: Course}} props */
export function Question({ course }) {
  const { answer, lesson: { question } } = course;
  const now = answer.value;
  if (now === null) return h(Asked, { course });
  const text = html`<p class="question-text" ...${written(question.text)}></p>`;
  const [title, words, again] = typeof now === "object" ? judged(now) : [...UNJUDGED[now], "Ask me"];
  return html`<div class="question" role="status">
    <h2>${title}</h2>
    ${text}
    ${typeof words === "string" ? html`<p class="verdict-words">${words}</p>` : words}
    ${h(Ways, { course, again })}
  </div>`;
}

/**
 * @param {VerdictPublic} verdict
 * @returns {[string, Child, string]}
 */
function judged({ right, words }) {
  const said = html`<div class="verdict-words">${words.map((sentence) => [html`<span ...${written(sentence)}></span>`, " "])}</div>`;
  return [right ? "✓ Right" : "✗ Not quite", said, "Ask me again"];
}

/** @param {{course: Course}} props */
function ToClass({ course }) {
  const ask = course.askClass.value;
  const title = "Ask this question as a poll with answers to choose from";
  return ask && html`<button type="button" title=${title} data-role="to-class" onClick=${ask}>Ask the class</button>`;
}

/** @param {{course: Course, again: string}} props */
function Ways({ course, again }) {
  const { next } = course.lesson;
  const onward = next && html`<a class="button primary" data-role="next-lesson" href=${`learn/${encodeURIComponent(next.id)}`}>Next: ${next.title}</a>`;
  return html`<div class="question-line">
    <button type="button" onClick=${() => course.again()}>${again}</button>
    ${h(ToClass, { course })}
    ${onward ?? (!isParticipant && html`<a class="button" href="learn">All lessons</a>`)}
  </div>`;
}

/** @param {{course: Course}} props */
function Asked({ course }) {
  const { question } = course.lesson;
  const isJudged = useSignal(false);
  const submit = async (/** @type {SubmitEvent & {currentTarget: HTMLFormElement}} */ event) => {
    event.preventDefault();
    const typed = String(new FormData(event.currentTarget).get("answer") ?? "").trim();
    // The server parses a typed number, and says what it accepts.
    const given = question.kind === "point" ? course.placed.value : typed;
    isJudged.value = true;
    if (given === null || given === "") course.say(`${FIRST[question.kind]} first, or skip the question.`);
    else await course.judge(given);
    isJudged.value = false;
  };
  const { words, isWrong } = course.said.value;
  return html`<form class="question" novalidate onSubmit=${submit}>
    <div><h2>Predict, then see</h2><p class="hint">${WAITING}</p></div>
    <p class="question-text" id="question" ...${written(question.text)}></p>
    <div class="question-line answering">
      ${h(Field, { question, placed: course.placed.value })}
      <button type="submit" class="primary" disabled=${isJudged.value}>Show</button>
      <button type="button" class="quiet" onClick=${() => course.skip()}>Skip</button>
      ${h(ToClass, { course })}
    </div>
    <p class=${isWrong ? "question-said wrong" : "question-said"} role="alert" hidden=${words === ""}>${words}</p>
  </form>`;
}

/** @param {{question: QuestionPublic, placed: number|null}} props */
function Field({ question: { kind, unit, choices }, placed }) {
  const named = { "aria-describedby": "question", "aria-label": HINTS[kind] };
  switch (kind) {
    case "number":
      return html`<input type="text" class="question-number" inputmode="decimal" name="answer" autocomplete="off" ...${named} />
        ${unit && html`<span>${unit}</span>`}`;
    case "choice":
      return html`<div class="question-choices" role="radiogroup" ...${named}>
        ${choices.map(({ name, words }) => html`<label class="question-choice">
          <input type="radio" name="answer" value=${name} /><span ...${written(words)}></span>
        </label>`)}
      </div>`;
    default:
      return html`<span class="hint">${HINTS.point}</span>
        <output class="question-spot">${placed === null ? "nowhere yet" : `at ${figure(placed, 3, unit)}`}</output>`;
  }
}
