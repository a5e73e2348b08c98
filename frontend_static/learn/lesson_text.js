/** The text of a lesson beside its figure: the idea, what to try, what is checked, and the way to its neighbours. */

import { fill, h, part } from "../shared/dom.js";
import { isParticipant } from "../shared/participant.js";
import { icon } from "../shared/icons.js";
import { checksOf } from "./checks.js";
import { lessons } from "./api.js";
import { htmlElement } from "./html_text.js";

/** @import { LessonDetail, NeighbourPublic } from "../shared/messages.js" */

/**
 * @param {LessonDetail} lesson
 * @param {AbortSignal} signal
 */
export function describe(lesson, signal) {
  const { idea, tries, notice, origin, previous, next, id } = lesson;
  fill(
    part("text"),
    h("h2", { class: "visually-hidden" }, "Idea"),
    htmlElement("div", idea, { class: "idea" }),
    tries.length > 0 && h("section", { class: "tries" }, h("h2", {}, "Try"), h("ul", {}, tries.map((each) => htmlElement("li", each)))),
    h("details", { class: "lesson-fold uses", data: { part: "uses" }, hidden: true }),
    checksOf(lesson, signal),
    !isParticipant && h("p", { class: "hint" }, h("a", { href: lessons.notebook(id), download: `${id}.ipynb` }, "Notebook of this lesson")),
    origin && h("p", { class: "hint" }, `From ${origin}`),
  );
  fill(part("neighbours"), neighbour(previous, "previous"), neighbour(next, "next"));
  part("notice").replaceChildren(htmlElement("span", notice));
}

/**
 * @param {NeighbourPublic|null} lesson
 * @param {"previous"|"next"} which
 */
function neighbour(lesson, which) {
  if (lesson === null) return null;
  const [rel, words] = which === "next" ? ["next", "Next lesson (N)"] : ["prev", "Previous lesson (P)"];
  const title = `${words}: ${lesson.title}`;
  return h("a", { class: "button quiet icon-only", href: `learn/${encodeURIComponent(lesson.id)}`, rel, title, "aria-label": title }, icon(which));
}
