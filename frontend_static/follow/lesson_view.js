/** The figure of a lesson that a class follows, as the lecturer has it, with its numbers and what the lecturer has moved. */

import { lessons } from "../learn/api.js";
import { FigureView } from "../shared/figure/figure.js";
import { showNumbers } from "../learn/numbers.js";
import { fill, h } from "../shared/dom.js";
import { ofLesson, showParameters } from "./parameter_list.js";

/** @import { FigurePublic, LessonDetail } from "../shared/messages.js" */
/** @import { Figure } from "../shared/figure/types.js" */

export class LessonView {
  #figure;
  #numbers = h("div", { class: "lesson-numbers" });
  #inForce = h("section", { class: "in-force", "aria-label": "Parameters in force" });
  #lesson;
  /** @type {FigurePublic|null} */
  #shown = null;
  /** @type {LessonDetail|null} */
  #known = null;

  /**
   * @param {HTMLElement} place
   * @param {string} lesson
   * @param {AbortSignal} signal
   */
  constructor(place, lesson, signal) {
    this.#lesson = lesson;
    const figure = h("div", { class: "lesson-figure-place" });
    const stage = h("div", { class: "lesson-show" }, figure);
    fill(place, h("div", { class: "follow-lesson" }, h("h2", { class: "visually-hidden" }, "Figure"), stage, this.#numbers, this.#inForce));
    // What the lecturer turns is turned nowhere else.
    this.#figure = new FigureView(figure, { declared: (name) => this.#declared(name) }, signal);
    this.#find();
  }

  /** @param {FigurePublic} shown */
  show(shown) {
    this.#shown = shown;
    this.#list();
    this.#figure.show(/** @type {Figure} */ (/** @type {unknown} */ (shown.figure)), { locked: true });
    showNumbers(this.#numbers, shown.numbers);
  }

  async #find() {
    // Without it the figure is still there, and says most of it.
    this.#known = await lessons.get(this.#lesson).catch(() => null);
    this.#list();
  }

  #list() {
    if (this.#known === null || this.#shown === null) return;
    showParameters(this.#inForce, ofLesson(this.#known, this.#shown.parameters, this.#shown.seed));
  }

  /** @param {string} name */
  #declared(name) {
    const found = this.#known?.declarations.find((declaration) => declaration.name === name);
    return found && { title: found.title, unit: found.unit, minimum: found.minimum, maximum: found.maximum, step: found.step };
  }
}
