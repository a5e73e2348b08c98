/** All lectures, and what classes have answered. */

import { answeredList } from "../lecturer/answered.js";
import { polls } from "../lecturer/api.js";
import { minutesText } from "../lecturer/walk.js";
import { messageOf } from "../shared/api.js";
import { confirmLoss } from "../shared/dialog.js";
import { fill, h, part } from "../shared/dom.js";
import { count, moment } from "../shared/format.js";
import { iconButton } from "../shared/icons.js";
import { navigation } from "../shared/navigation.js";
import { notice } from "../shared/notice.js";
import { themeButton } from "../shared/theme.js";
import { attempt } from "../shared/toast.js";
import { lectures } from "../lecturer/lectures_api.js";
import { beginLecture } from "./start.js";

/** @import { LectureSummary, PollKept } from "../shared/messages.js" */

const LEAD =
  "A lecture puts lessons, failures, sessions, comparisons and polls into an order. While you present, Next moves on, the class " +
  "comes along, and a clock tells how long each item takes.";
const EMPTY = "No lecture has been made yet. A new one is empty; or open the file of one that somebody shared.";
const UNANSWERED = "No class has answered a poll yet. Answers are kept here without names.";

navigation("lectures");
part("tools").append(themeButton());
addEventListener("pageshow", (event) => event.persisted && load());
load();

async function load() {
  try {
    const [all, answered] = await Promise.all([lectures.all(), polls.all()]);
    draw(all);
    drawAnswered(answered);
  } catch (error) {
    fill(part("list"), notice("The lectures could not be listed", messageOf(error), { label: "Try again", run: load }, { inline: true }));
  }
}

/** @param {readonly LectureSummary[]} all */
function draw(all) {
  /** @type {HTMLInputElement} */
  const file = h("input", {
    type: "file", accept: ".md,text/markdown", class: "visually-hidden", tabindex: -1, "aria-label": "File of a lecture", on: { change: bringIn },
  });
  fill(
    part("list"),
    h(
      "header",
      {},
      h("div", {}, h("h2", {}, "Lectures"), h("p", { class: "hint" }, LEAD)),
      h(
        "div",
        { class: "row-actions" },
        file,
        h("button", { type: "button", on: { click: () => file.click() } }, "Open a file"),
        h("button", { type: "button", class: "primary", on: { click: add } }, "New lecture"),
      ),
    ),
    all.length > 0 ? h("ul", { class: "rows" }, all.map(row)) : h("p", { class: "empty" }, EMPTY),
  );

  async function bringIn() {
    const [chosen] = file.files ?? [];
    if (!chosen) return;
    const made = await attempt(() => lectures.bringIn(chosen));
    file.value = "";
    if (made !== undefined) location.assign(made.page);
  }
}

async function add() {
  const made = await attempt(() => lectures.add({ title: "New lecture" }));
  if (made !== undefined) location.assign(made.page);
}

/** @param {LectureSummary} lecture */
function row({ id, title, count: items, minutes, updated, page }) {
  const start = async () => {
    const lecture = await attempt(() => lectures.get(id));
    if (lecture !== undefined) beginLecture(lecture);
  };
  const remove = async () => {
    const text = `${title} is lost for good, unless you downloaded it. What was answered in it stays.`;
    if (await confirmLoss({ title: "Delete this lecture?", text, action: "Delete it" })) await attempt(() => lectures.remove(id).then(load));
  };
  const facts = [count(items, "item"), minutesText(minutes), moment(updated)];
  return h(
    "li",
    { class: "row", data: { lecture: id } },
    h("div", { class: "row-words" }, h("a", { class: "row-title", href: page }, title), h("span", { class: "hint" }, facts.join(", "))),
    h(
      "div",
      { class: "row-actions" },
      h("button", { type: "button", class: "primary", disabled: items === 0, on: { click: start } }, "Begin"),
      h("a", { class: "button", href: page }, "Edit"),
      h("a", { class: "button", href: lectures.fileAddress(id), download: "", "aria-label": `Download ${title}` }, "Download"),
      iconButton("trash", `Delete ${title}`, remove),
    ),
  );
}

/** @param {readonly PollKept[]} answered */
function drawAnswered(answered) {
  const csv = h("a", { class: "button", href: polls.csvAddress(), download: "" }, "Download as CSV");
  fill(
    part("answered"),
    h("header", {}, h("h2", {}, "What classes have answered"), answered.length > 0 && csv),
    answered.length > 0 ? answeredList(answered, { remove: load }) : h("p", { class: "empty" }, UNANSWERED),
  );
}
