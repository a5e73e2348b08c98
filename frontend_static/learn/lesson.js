/** The page of a lesson: it finds the lesson, and says so where there is none. */

import { messageOf, statusOf } from "../shared/api.js";
import { fill, h, lastOfAddress, part } from "../shared/dom.js";
import { navigation } from "../shared/navigation.js";
import { notice } from "../shared/notice.js";
import { presentationButton } from "../shared/presentation.js";
import { themeButton } from "../shared/theme.js";
import { lessons } from "./api.js";
import { Course } from "./course.js";
import { followLesson } from "./following.js";
import { help, listen } from "./keys.js";
import { Newest } from "./newest.js";
import { describe } from "./text.js";
import { Uses } from "./uses.js";

/** @import { LessonDetail, LessonsPublic } from "../shared/messages.js" */

const { signal } = new AbortController();
const id = lastOfAddress();

// What was shown has been ended when the page was left.
globalThis.addEventListener("pageshow", (event) => event.persisted && location.reload());

const keys = h("button", { type: "button", class: "quiet icon-only", title: "Keys (?)", "aria-label": "Keys", on: { click: help } }, "?");
navigation("learn");
fill(part("tools"), themeButton(), presentationButton(), keys);
const opening = new Newest(() => Promise.all([lessons.get(id), lessons.all()]), { answer: ([lesson, all]) => open(lesson, all), refused, lost }, signal);
opening.ask(null);

/**
 * @param {LessonDetail} lesson
 * @param {LessonsPublic} all
 */
function open(lesson, all) {
  document.title = `${lesson.title} · pftrack`;
  fill(part("title"), lesson.number ? `${lesson.number} · ${lesson.title}` : lesson.title);
  describe(lesson, signal);
  const course = new Course(lesson, all, lost, signal);
  const uses = new Uses(lesson, signal);
  part("tools").prepend(followLesson(lesson, { course, uses }, signal));
  listen(lesson, () => course.draw(), signal);
}

/** @param {unknown} error */
function refused(error) {
  const title = statusOf(error) === 404 ? "There is no such lesson" : "This lesson cannot be shown";
  fill(part("lesson"), notice(title, messageOf(error), { label: "All lessons", href: "/learn" }));
}

/** @param {boolean} isLost */
function lost(isLost) {
  part("disconnected").hidden = !isLost;
}
