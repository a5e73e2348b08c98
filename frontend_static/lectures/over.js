/** What a lecturer finds after a lecture: how long it took, and the class, which goes on following until it is ended. */

import { ClassControl } from "../lecturer/class_control.js";
import { following } from "../lecturer/text.js";
import { clock, clockWords, walkOfTab } from "../lecturer/walk.js";
import { fill, h } from "../shared/dom.js";

/**
 * Say that a lecture is over, where this tab has just held it.
 *
 * @param {string} lecture
 * @param {AbortSignal} signal
 * @returns {HTMLElement|null} Null where it was not held here, or goes on.
 */
export function over(lecture, signal) {
  const walk = walkOfTab();
  if (walk === null || walk.lecture !== lecture || walk.ended === null) return null;
  // Nothing of this page is for a class.
  const control = new ClassControl(() => null, signal);
  const ofClass = h("p", { class: "lecture-class", hidden: true });
  const end = h("button", { type: "button", class: "primary", data: { role: "end-class" }, on: { click: () => control.end() } }, "End for the class");
  let hadClass = false;
  control.on(["follow"], () => {
    const { follow } = control;
    hadClass ||= follow !== null;
    ofClass.hidden = !hadClass;
    const words = follow === null ? "The class has ended." : `${following(follow.followers)}; the pages of the class stay open until you end it.`;
    fill(ofClass, h("span", {}, words), follow !== null && end);
  }, signal);
  control.find();
  return h(
    "section",
    { class: "lecture-over", "aria-label": "The lecture is over", role: "status" },
    h("h2", {}, "The lecture is over"),
    h("p", {}, `It took ${clockWords(clock(walk, Date.now()).whole)}. Below stand how long each item took, and what was answered.`),
    ofClass,
  );
}
