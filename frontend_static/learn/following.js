/** A lesson that a class follows: its figure, or the run that stands in its place. */

import { followChip } from "../lecturer/chip.js";
import { ClassControl } from "../lecturer/class_control.js";
import { part } from "../shared/dom.js";

/** @import { LessonDetail } from "../shared/messages.js" */
/** @import { Course } from "./course.js" */
/** @import { Uses } from "./uses.js" */

/**
 * @param {LessonDetail} lesson
 * @param {{course: Course, uses: Uses}} parts
 * @param {AbortSignal} signal
 * @returns {HTMLElement} The chip.
 */
export function followLesson(lesson, { course, uses }, signal) {
  const run = () => uses.stage ?? course.run;
  const control = new ClassControl(() => {
    const { title, id } = lesson;
    const stage = run();
    if (stage === null) return { title, sessions: [], lesson: id };
    const { session, scenario: { plots, layers } } = stage;
    return session === null ? null : { title, sessions: [session], lesson: id, arrangement: { plots, layers } };
  }, signal);
  control.on(["follow"], () => {
    const isLed = control.isHere && control.follow !== null && control.follow.poll === null;
    course.offerClass(isLed ? () => control.ask({ lesson: lesson.id }) : null);
    const poll = control.isHere ? control.follow?.poll : null;
    if (poll?.revealed && poll.lesson === lesson.id) course.answered();
  }, signal);
  control.on(["follow"], () => course.followedBy(control.isHere && run() === null ? (control.follow?.id ?? null) : null), signal);
  for (const each of [course, uses]) each.onRun(() => control.update());
  // The next lesson is the next page of the lecture.
  part("neighbours").addEventListener("click", () => control.takeAlong(), { signal });
  control.find();
  return followChip(control, signal);
}
