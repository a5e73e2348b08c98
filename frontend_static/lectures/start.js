/** How a lecture begins, or goes on: with an item's page, presented, and with the class of this tab. */

import { takeClassAlong } from "../lecturer/class_control.js";
import { begin, keepWalk, pageOf, walkOfTab } from "../lecturer/walk.js";
import { presentNext } from "../shared/presentation.js";
import { toast } from "../shared/toast.js";

/** @import { LecturePublic } from "../shared/messages.js" */
/** @import { Walk } from "../lecturer/walk.js" */

/**
 * Show the first item.
 *
 * @param {LecturePublic} lecture
 */
export function beginLecture(lecture) {
  const walk = begin(lecture, Date.now());
  if (walk === null) toast("There is nothing to show yet: add a lesson, a failure, a session or a comparison.", { kind: "error" });
  else open(walk);
}

/**
 * The walk through a lecture that this tab has begun and not finished.
 *
 * @param {string} lecture
 * @returns {Walk|null}
 */
export function unfinished(lecture) {
  const walk = walkOfTab();
  return walk !== null && walk.lecture === lecture && walk.ended === null ? walk : null;
}

/**
 * Show the item at which the lecturer left.
 *
 * @param {Walk} walk
 */
export function open(walk) {
  keepWalk(walk);
  takeClassAlong();
  presentNext();
  location.assign(pageOf(walk));
}
