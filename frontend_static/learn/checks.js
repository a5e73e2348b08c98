/** The checks of a lesson: what it claims, computed on the server when somebody looks, each beside what is exact. */

import { messageOf } from "../shared/api.js";
import { fill, h } from "../shared/dom.js";
import { after } from "../shared/timing.js";
import { lessons } from "./api.js";
import { mark } from "./numbers.js";
import { checked } from "./number_text.js";

/** @import { ChecksPublic, LessonDetail } from "../shared/messages.js" */

const AGAIN_MS = 700;

/**
 * @param {LessonDetail} lesson
 * @param {AbortSignal} signal
 * @returns {HTMLElement|null} A fold; nothing where there is nothing to check.
 */
export function checksOf({ id, checks }, signal) {
  if (checks.length === 0) return null;
  const summary = h("summary", {}, `What is checked (${checks.length})`);
  const list = h("ul", { class: "checks" }, checks.map(({ title }) => h("li", {}, title)));
  const progress = h("p", { class: "hint", role: "status" });
  /** @type {HTMLDetailsElement} */
  const fold = h("details", { class: "lesson-fold" }, summary, progress, list);
  let isAsked = false;
  fold.addEventListener("toggle", () => {
    if (!fold.open || isAsked) return;
    isAsked = true;
    follow(id, (found) => show(found, summary, progress, list), signal).catch((error) => {
      isAsked = false;
      fill(progress, messageOf(error));
    });
  }, { signal });
  return fold;
}

/**
 * Ask until all are computed.
 *
 * @param {string} id
 * @param {(found: ChecksPublic) => void} tell
 * @param {AbortSignal} signal
 */
async function follow(id, tell, signal) {
  for (;;) {
    const found = await lessons.checks(id);
    if (signal.aborted) return;
    tell(found);
    if (found.done >= found.total) return;
    await after(AGAIN_MS, signal);
  }
}

/**
 * @param {ChecksPublic} found
 * @param {HTMLElement} summary
 * @param {HTMLElement} progress
 * @param {HTMLElement} list
 */
function show({ done, total, results }, summary, progress, list) {
  const isDone = done >= total;
  fill(progress, isDone ? "" : `Computing: ${done} of ${total} checked`);
  if (results.length === 0) return;
  const passed = results.filter((each) => each.passed).length;
  fill(summary, passed === total ? `All ${total} checks pass` : `${passed} of ${total} checks pass`);
  fill(list, results.map((each) => h("li", { data: { check: each.check } }, each.title, h("span", { class: "hint" }, checked(each), mark(each.passed)))));
}
