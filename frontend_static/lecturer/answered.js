/** What classes have answered: a line for each poll, which opens its bars. */

import { confirmLoss } from "../shared/dialog.js";
import { h } from "../shared/dom.js";
import { moment } from "../shared/format.js";
import { iconButton } from "../shared/icons.js";
import { attempt } from "../shared/toast.js";
import { polls } from "./api.js";
import { PollView } from "./poll.js";

/** @import { PollKept } from "../shared/messages.js" */

/**
 * @typedef {object} Ways What can be done with a poll.
 * @property {() => unknown} [remove] Called when one has been deleted.
 * @property {(poll: PollKept) => unknown} [again] Show its answers to the class again.
 * @property {boolean} [isOpen] Whether the bars of all are in sight at once.
 */

/**
 * @param {readonly PollKept[]} kept
 * @param {Ways} ways
 */
export function answeredList(kept, ways) {
  return h("ul", { class: "rows answered" }, kept.map((poll) => h("li", {}, entry(poll, ways))));
}

/**
 * @param {PollKept} poll
 * @param {Ways} ways
 */
function entry(poll, { remove, again, isOpen = false }) {
  const forget = async () => {
    const text = `“${poll.question}” and its ${poll.votes} answers are lost for good, unless you downloaded them.`;
    if (await confirmLoss({ title: "Delete this poll?", text, action: "Delete it" })) await attempt(() => polls.remove(poll.id).then(remove));
  };
  const view = new PollView({
    vote: null,
    tools: [
      again && h("button", { type: "button", on: { click: () => again(poll) } }, "Show again"),
      remove && iconButton("trash", `Delete ${poll.question}`, forget),
    ],
  });
  view.show({ ...poll, lesson: null, revealed: true });
  const facts = [poll.lecture_title ?? poll.title, `${poll.votes} of ${poll.followers} answered`, moment(poll.asked)];
  return h(
    "details",
    { data: { poll: poll.id }, open: isOpen },
    h(
      "summary",
      { class: "row" },
      h("span", { class: "row-words" }, h("span", { class: "row-title" }, poll.question), h("span", { class: "hint" }, facts.join(", "))),
    ),
    view.element,
  );
}
