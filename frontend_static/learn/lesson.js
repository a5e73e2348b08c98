/** The page of a lesson: it finds the lesson, and says so where there is none. */

import { END_FORK, endFork } from "../lecturer/end_fork.js";
import { START } from "../shared/address.js";
import { messageOf, statusOf } from "../shared/api.js";
import { fill, h, lastOfAddress, part } from "../shared/dom.js";
import { brand, isFollower, isParticipant } from "../shared/participant.js";
import { navigation } from "../shared/navigation.js";
import { notice } from "../shared/notice.js";
import { presentationButton } from "../shared/presentation.js";
import { printButton } from "../shared/print.js";
import { themeButton } from "../shared/theme.js";
import { lessons } from "./api.js";
import { Course } from "./course.js";
import { followLesson } from "./following.js";
import { help, listen } from "./keys.js";
import { NewestRequest } from "../shared/newest_request.js";
import { describe } from "./lesson_text.js";
import { Uses } from "./uses.js";

/** @import { LessonDetail, LessonsPublic } from "../shared/messages.js" */

/** @type {LessonsPublic} */
const NO_OTHERS = { lessons: [], problems: [] };
const { signal } = new AbortController();
const id = lastOfAddress();

// What was shown has been ended when the page was left.
globalThis.addEventListener("pageshow", (event) => event.persisted && location.reload());

const keys = h("button", { type: "button", class: "quiet icon-only", title: "Keys (?)", "aria-label": "Keys", on: { click: help } }, "?");
part("brand").replaceWith(brand());
if (!isParticipant) navigation("learn");
const end = isFollower && h("button", { type: "button", title: END_FORK, data: { role: "end" }, on: { click: endFork } }, "End");
fill(part("tools"), end, themeButton(), printButton(), presentationButton(), keys);
const find = () => Promise.all([lessons.get(id).then(forMe), isParticipant ? NO_OTHERS : lessons.all()]);
const opening = new NewestRequest(find, { answer: ([lesson, all]) => open(lesson, all), refused, lost }, signal);
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
  if (!isFollower) part("tools").prepend(followLesson(lesson, { course, uses }, signal));
  listen(() => course.draw(), signal);
}

/**
 * Whoever came by the link of a class has this lesson, and none of what leads elsewhere.
 *
 * @param {LessonDetail} lesson
 * @returns {LessonDetail}
 */
function forMe(lesson) {
  return isParticipant ? { ...lesson, previous: null, next: null, uses: [], checks: [] } : lesson;
}

/** @param {unknown} error */
function refused(error) {
  const title = statusOf(error) === 404 ? "There is no such lesson" : "This lesson cannot be shown";
  const way = isParticipant ? { label: "Back to the class", href: START } : { label: "All lessons", href: "learn" };
  fill(part("lesson"), notice(title, messageOf(error), way));
}

/** @param {boolean} isLost */
function lost(isLost) {
  part("disconnected").hidden = !isLost;
}
