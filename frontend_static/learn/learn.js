/** The overview of all lessons: the course in its order, what lecturers have added, and what of that cannot be read. */

import { START } from "../shared/address.js";
import { messageOf } from "../shared/api.js";
import { fill, h, part } from "../shared/dom.js";
import { count } from "../shared/format.js";
import { navigation } from "../shared/navigation.js";
import { notice } from "../shared/notice.js";
import { presentationButton } from "../shared/presentation.js";
import { themeButton } from "../shared/theme.js";
import { lessons } from "./api.js";
import { NewestRequest } from "../shared/newest_request.js";
import { Progress } from "./progress.js";
import { standing, stateOf } from "./number_text.js";

/** @import { LessonPublic, LessonsPublic, LessonProblem } from "../shared/messages.js" */

const LEAD =
  "Twelve steps from an average to a colour tracker. Each asks for your prediction first, then shows the result, and says how far off it " +
  "was and why. Your progress stays in this browser.";
const NO_LESSONS = "No lessons are installed; pftrack was installed without its course.";

const SIGNS = { open: "", skipped: "–", right: "✓", wrong: "✗" };

const page = new AbortController();
const progress = new Progress();
navigation("learn");
fill(part("tools"), presentationButton(), themeButton());
const listing = new NewestRequest(() => lessons.all(), {
  answer: (all) => show(all),
  refused: (error) => fill(part("learn"), notice("The lessons cannot be listed", messageOf(error), { label: "Back to the experiments", href: START })),
  lost: (isLost) => (part("disconnected").hidden = !isLost),
}, page.signal);
listing.ask(null);
// Somebody comes back from a lesson that has been answered.
globalThis.addEventListener("pageshow", (event) => event.persisted && location.reload());

/** @param {LessonsPublic} all */
function show({ lessons: found, problems }) {
  const course = found.filter(({ number }) => number > 0);
  const others = found.filter(({ number }) => number === 0);
  const done = progress.done(course);
  const next = course.find(({ id }) => progress.of(id) === null);
  fill(
    part("learn"),
    h(
      "header",
      { class: "learn-head" },
      h("div", {}, h("h2", {}, "The course"), h("p", { class: "hint" }, LEAD)),
      next && wayOn(next, done === 0),
    ),
    progress.remark && h("p", { class: "note", role: "status" }, progress.remark),
    h(
      "p",
      { class: "learn-progress" },
      h("progress", { max: Math.max(1, course.length), value: done, "aria-label": "Lessons answered" }),
      h("span", {}, `${done} of ${course.length} done`),
    ),
    course.length === 0 ? h("p", { class: "empty" }, NO_LESSONS) : h("ol", { class: "course" }, course.map(card)),
    (others.length > 0 || problems.length > 0) && h("h2", {}, "Other lessons"),
    others.length > 0 && h("ul", { class: "course" }, others.map(card)),
    problems.length > 0 && broken(problems),
  );
}

/**
 * @param {LessonPublic} lesson The first that was not looked at.
 * @param {boolean} isFirst
 */
function wayOn(lesson, isFirst) {
  const words = `${isFirst ? "Begin with" : "Continue with"} ${lesson.number} · ${lesson.title}`;
  return h("a", { class: "button primary", href: address(lesson), data: { role: "continue" } }, words);
}

/** @param {LessonPublic} lesson */
function card(lesson) {
  const { id, number, title, origin, uses, problem, kind, minutes } = lesson;
  const entry = progress.of(id);
  const state = stateOf(entry);
  const titles = uses.map((each) => each.title);
  const words = [standing(entry), `${minutes} min`, kind === "scenario" && "a run to watch", origin && `from ${origin}`];
  return h(
    "li",
    { class: "lesson-card", data: { lesson: id, state } },
    h("span", { class: "lesson-sign", "aria-hidden": "true" }, SIGNS[state]),
    h(
      "div",
      { class: "row-words" },
      h("a", { class: "row-title", href: address(lesson) }, number > 0 ? `${number} · ${title}` : title),
      h("span", { class: "hint" }, words.filter(Boolean).join(" · ")),
      problem !== null && h("span", { class: "wrong" }, problem),
      titles.length > 0 &&
        h("span", { class: "hint" }, "Used in ", titles.map((used, index) => titles.indexOf(used) === index && [index > 0 && ", ", use(lesson, used, index)])),
    ),
  );
}

/**
 * @param {LessonPublic} lesson
 * @param {string} title Of the experiment.
 * @param {number} index
 */
function use(lesson, title, index) {
  return h("a", { href: `${address(lesson)}#use-${index + 1}` }, title);
}

/** @param {readonly LessonProblem[]} problems */
function broken(problems) {
  return h(
    "section",
    { class: "learn-problems", "aria-label": "Lessons that cannot be read" },
    h("h3", {}, `${count(problems.length, "lesson")} that cannot be read`),
    h("ul", {}, problems.map(({ origin, line, message }) => h("li", {}, h("b", {}, line === 0 ? origin : `${origin}, line ${line}`), ": ", message))),
  );
}

/** @param {{id: string}} lesson */
function address({ id }) {
  return `learn/${encodeURIComponent(id)}`;
}
