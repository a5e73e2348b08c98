/** The form by which a lecturer asks the class: a question, and two to eight answers. */

import { h } from "../shared/dom.js";
import { iconButton } from "../shared/icons.js";

/** @import { PollCreateRequest } from "../shared/messages.js" */

const FEWEST = 2;
const MOST = 8;
const LONGEST_QUESTION = 300;
const LONGEST_ANSWER = 100;
const FIRST = ["Yes", "No"];

/**
 * @param {(poll: PollCreateRequest) => Promise<unknown>} ask
 * @param {string} [action] The word for it.
 * @returns {HTMLFormElement}
 */
export function pollForm(ask, action = "Ask the class") {
  const question = text({ id: "poll-question", maxlength: LONGEST_QUESTION, placeholder: "Will it survive the pillar?" });
  const answers = h("ol", { class: "poll-fields" });
  const more = h("button", { type: "button", class: "quiet", on: { click: () => add("").focus() } }, "Another answer");
  const go = h("button", { type: "submit", class: "primary" }, action);
  const form = h(
    "form",
    { class: "poll-form", novalidate: true, on: { submit } },
    h("label", { for: "poll-question" }, "Question"),
    question,
    answers,
    h("div", { class: "poll-line" }, more, go),
  );
  FIRST.forEach((answer) => add(answer));
  form.addEventListener("input", look);
  look();
  return form;

  /** @param {string} value */
  function add(value) {
    const field = text({ value, maxlength: LONGEST_ANSWER });
    const remove = () => {
      line.remove();
      look();
    };
    const line = h("li", {}, field, iconButton("close", "Remove this answer", remove));
    answers.append(line);
    look();
    return field;
  }

  function fields() {
    return [...answers.querySelectorAll("input")];
  }

  function look() {
    fields().forEach((field, place) => field.setAttribute("aria-label", `Answer ${place + 1}`));
    for (const away of answers.querySelectorAll("button")) away.disabled = fields().length <= FEWEST;
    more.hidden = fields().length >= MOST;
    go.disabled = question.value.trim() === "" || written().length < FEWEST;
  }

  function written() {
    return fields().map(({ value }) => value.trim()).filter((answer) => answer !== "");
  }

  /** @param {SubmitEvent} event */
  async function submit(event) {
    event.preventDefault();
    if (go.disabled) return;
    go.disabled = true;
    await ask({ question: question.value.trim(), answers: written() });
    look();
  }
}

/** @param {import("../shared/elements.js").Properties} properties */
function text(properties) {
  return h("input", { type: "text", autocomplete: "off", ...properties });
}
