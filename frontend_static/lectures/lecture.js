/** The page on which a lecture is made: its order, what it can be made of, and how it begins. What is changed is saved at once. */

import { answeredList } from "../lecturer/answered.js";
import { polls } from "../lecturer/api.js";
import { minutesText, spentOn, time, walkOfTab } from "../lecturer/walk.js";
import { messageOf, statusOf } from "../shared/api.js";
import { askName } from "../shared/dialog.js";
import { fill, h, lastOfAddress, part, setText } from "../shared/dom.js";
import { count } from "../shared/format.js";
import { navigation } from "../shared/navigation.js";
import { NewestRequest } from "../shared/newest_request.js";
import { notice } from "../shared/notice.js";
import { themeButton } from "../shared/theme.js";
import { toast } from "../shared/toast.js";
import { lectures } from "../lecturer/lectures_api.js";
import { OrderList } from "./order.js";
import { over } from "./over.js";
import { palette } from "./palette.js";
import { beginLecture, open, unfinished } from "./start.js";

/** @import { LecturePublic, LectureUpdate } from "../shared/messages.js" */
/** @import { Entry } from "./order.js" */
/** @import { New } from "./palette.js" */

const EMPTY = "Nothing is in it yet. Add a lesson, a failure, a session, a comparison or a poll.";
const NOT_FOUND = 404;
const ALL = { label: "All lectures", href: "lectures" };
const id = lastOfAddress();
/** Nothing ends what listens here but the page itself. */
const page = new AbortController();
const saving = new NewestRequest((/** @type {LectureUpdate} */ wish) => lectures.change(id, wish), {
  answer: (answer, _, isNewest) => isNewest && take(answer),
  refused: (error) => toast(messageOf(error), { kind: "error" }),
  lost: (isLost) => (part("disconnected").hidden = !isLost),
}, page.signal);

/** @type {LecturePublic} */
let lecture;
/** @type {Entry[]} */
let entries = [];
let keys = 0;
const title = h("input", { type: "text", id: "lecture-title", maxlength: 200, on: { change: () => save() } });
const notes = h("textarea", { id: "lecture-notes", rows: 4, maxlength: 10_000, on: { change: () => save() } });
const total = h("p", { class: "lecture-total", role: "status" });
const ways = h("div", { class: "row-actions" });
const empty = h("p", { class: "empty" }, EMPTY);
const answered = h("section", { "aria-label": "Polls of this lecture" });
const order = new OrderList({ changed: (found) => change(found), rename, note: taken });

navigation("lectures");
part("tools").append(themeButton());
addEventListener("pageshow", (event) => event.persisted && location.reload());
load();

async function load() {
  try {
    lecture = await lectures.get(id);
  } catch (error) {
    const isUnknown = statusOf(error) === NOT_FOUND;
    const what = isUnknown ? "There is no such lecture" : "The lecture cannot be shown";
    fill(part("lecture"), notice(what, messageOf(error), isUnknown ? ALL : { label: "Try again", run: load }));
    return;
  }
  title.value = lecture.title;
  notes.value = lecture.notes;
  const download = h("a", { class: "button", href: lectures.fileAddress(id), download: "", title: "One small text file, which can be shared" }, "Download");
  fill(
    part("lecture"),
    over(id, page.signal),
    h(
      "div",
      { class: "lecture-head" },
      h("div", { class: "lecture-name" }, h("label", { for: "lecture-title" }, "Title"), title),
      h("div", { class: "row-actions" }, download, ways),
    ),
    h(
      "div",
      { class: "lecture-parts" },
      h(
        "div",
        { class: "lecture-own" },
        h("header", {}, h("h2", {}, "Order"), total),
        empty,
        order.element,
        answered,
        h("label", { for: "lecture-notes" }, "Notes, for you alone"),
        notes,
      ),
      palette(add),
    ),
  );
  take(lecture);
  drawAnswered();
}

/**
 * What the server makes of what was sent: titles, pages, and what is not here.
 *
 * @param {LecturePublic} found
 */
function take(found) {
  lecture = found;
  document.title = `${found.title} · pftrack`;
  setText(part("title"), found.title);
  // An entry keeps its key, so that the focus stays where it is.
  entries = found.items.map((item, place) => ({ ...item, key: entries.length === found.items.length ? entries[place].key : keys++ }));
  draw();
}

/** @param {Entry[]} found */
function change(found) {
  entries = found;
  draw();
  save();
}

function save() {
  const name = title.value.trim() || lecture.title;
  title.value = name;
  saving.ask({ title: name, notes: notes.value, items: entries.map(({ item }) => item) });
}

/** @param {New} added */
function add(added) {
  change([...entries, { ...added, key: keys++, page: null, asks: null, problem: null }]);
  toast(`${added.title} is item ${entries.length}`);
}

/** @param {Entry} entry */
async function rename(entry) {
  const name = await askName(`Rename ${entry.title}`, entry.title);
  if (name === null) return;
  change(entries.map((each) => (each.key === entry.key ? { ...each, title: name, item: { ...each.item, title: name } } : each)));
}

function draw() {
  empty.hidden = entries.length > 0;
  order.show(entries);
  setText(total, `${count(entries.length, "item")}, ${minutesText(entries.reduce((sum, { minutes }) => sum + minutes, 0))}`);
  const walk = unfinished(id);
  const words = walk ? "Begin again" : "Begin the lecture";
  const begin = h("button", { type: "button", class: walk ? "" : "primary", disabled: entries.length === 0, on: { click: start } }, words);
  const goOn = walk && h("button", { type: "button", class: "primary", on: { click: () => open(walk) } }, `Continue with item ${walk.at + 1}`);
  fill(ways, begin, goOn);
}

/** What was changed a moment ago is part of it. */
async function start() {
  save();
  await saving.ask({ title: title.value, notes: notes.value, items: entries.map(({ item }) => item) });
  beginLecture(lecture);
}

/**
 * How long an item took when the lecture was last held in this tab.
 *
 * @param {Entry} entry
 */
function taken(entry) {
  const walk = walkOfTab();
  if (walk === null || walk.lecture !== id) return "";
  const at = walk.steps.findIndex(({ kind, title: name }) => kind === entry.kind && name === entry.title);
  const spent = at < 0 ? 0 : spentOn(walk, at, Date.now());
  return spent > 0 ? `took ${time(spent)} last time` : "";
}

async function drawAnswered() {
  const kept = await polls.all(id).catch(() => []);
  answered.hidden = kept.length === 0;
  fill(
    answered,
    h("header", {}, h("h2", {}, "What was answered"), h("a", { class: "button", href: polls.csvAddress(id), download: "" }, "Download as CSV")),
    answeredList(kept, { remove: drawAnswered, isOpen: true }),
  );
}
