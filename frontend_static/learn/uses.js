/**
 * Where the idea of a lesson is used: links that put a session in the place of the figure. They have an address of their
 * own, so that the way back is the browser's as well.
 */

import { here } from "../shared/address.js";
import { fill, h, part } from "../shared/dom.js";
import { linkTo } from "../shared/share_link.js";
import { htmlElement } from "./html_text.js";
import { ScenarioStage } from "./scenario.js";

/** @import { LessonDetail, ScenarioPublic } from "../shared/messages.js" */

const HASH = /^#use-(\d+)$/;

export class Uses {
  #lesson;
  #changed = () => {};

  /**
   * The run that is shown, if one is.
   *
   * @type {ScenarioStage|null}
   */
  stage = null;

  /**
   * @param {LessonDetail} lesson
   * @param {AbortSignal} signal
   */
  constructor(lesson, signal) {
    this.#lesson = lesson;
    if (lesson.uses.length === 0) return;
    const entries = lesson.uses.map((use, index) => h("li", {}, entry(use, index)));
    fill(part("uses"), h("summary", {}, `Where it is used (${entries.length})`), h("ul", {}, entries));
    part("uses").hidden = false;
    globalThis.addEventListener("hashchange", () => this.#go(), { signal });
    this.#go();
  }

  /**
   * Be told when a run takes the place of the figure, or leaves it.
   *
   * @param {() => void} changed
   */
  onRun(changed) {
    this.#changed = changed;
  }

  #go() {
    this.stage?.dispose();
    this.stage = null;
    const which = HASH.exec(location.hash);
    const use = which ? this.#lesson.uses[Number(which[1]) - 1] : undefined;
    const isOpen = use !== undefined && use.problem === null;
    part("own").hidden = isOpen;
    part("use").hidden = !isOpen;
    part("question").hidden = isOpen;
    if (!isOpen) {
      this.#changed();
      return;
    }
    const places = { show: h("div", { class: "lesson-show" }), controls: h("div", { class: "lesson-controls" }) };
    fill(
      part("use"),
      h(
        "div",
        { class: "use-line" },
        htmlElement("p", use.words),
        h("a", { class: "button", href: linkTo({ recipe: use.recipe, position: use.frame }), target: "_blank" }, "Open as a session"),
        h("a", { class: "button primary", href: here("") }, "Back to the lesson"),
      ),
      places.show,
      places.controls,
    );
    this.stage = new ScenarioStage(places, use, { isLocked: false, known: () => this.#changed() });
  }
}

/**
 * @param {ScenarioPublic} use
 * @param {number} index
 */
function entry({ words, title, problem }, index) {
  if (problem !== null) return [htmlElement("span", words), " ", h("span", { class: "hint" }, problem)];
  return [h("a", { href: here(`use-${index + 1}`) }, title), ": ", htmlElement("span", words)];
}
