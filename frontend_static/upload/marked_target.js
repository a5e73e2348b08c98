/** A target that a person has to mark, in one of the ways that the experiment takes; or all of a recording, unmarked. */

import { api } from "../shared/api.js";
import { fill, h } from "../shared/dom.js";
import { markEditor } from "../shared/marks/mark_editor.js";

/** @import { Mark } from "../shared/marks/mark_json.js" */

/**
 * @typedef {import("../shared/messages.js").ExperimentPublic} ExperimentPublic
 * @typedef {import("../shared/messages.js").UploadPublic} UploadPublic
 */

export class MarkedTarget {
  /** @type {HTMLElement} */
  #root;
  /** @type {UploadPublic} */
  #upload;
  /** @type {ExperimentPublic} */
  #experiment;
  /** @type {{changed: () => void}} */
  #on;
  #frame = 0;
  /** @type {import("../shared/marks/mark_editor.js").MarkEditor|null} */
  #editor = null;
  /** What is shown where nothing is to be marked. */
  #picture = h("img", { class: "target-picture", alt: "The frame to begin with" });

  /**
   * @param {HTMLElement} root
   * @param {UploadPublic} upload
   * @param {ExperimentPublic} experiment
   * @param {{changed: () => void}} on
   */
  constructor(root, upload, experiment, on) {
    [this.#root, this.#upload, this.#experiment, this.#on] = [root, upload, experiment, on];
    this.#take(experiment.marks[0]?.kind);
  }

  /** Whether the recording may go without a mark. */
  get #isOptional() {
    return this.#experiment.unmarked.includes(this.#upload.kind);
  }

  /** What a session is told of the target, or null while there is nothing to tell. */
  get footage() {
    const start = this.#frame;
    if (this.#editor === null) return { start };
    const { mark } = this.#editor;
    if (mark !== null) return { mark, start };
    return this.#isOptional ? { start } : null;
  }

  /**
   * Show a frame; the mark stays.
   *
   * @param {number} frame
   */
  show(frame) {
    this.#frame = frame;
    const address = api.pictureAddress(this.#upload.id, frame);
    if (this.#editor === null) this.#picture.src = address;
    else this.#editor.show(address, this.#upload.width, this.#upload.height);
  }

  /** Nothing is found by itself. */
  find() {}

  focus() {
    this.#editor?.focus();
  }

  leave() {}

  /**
   * Take another mark in place of the one that is shown.
   *
   * @param {Mark} mark Of a kind that the experiment takes.
   */
  adopt(mark) {
    if (this.#editor?.mark?.kind !== mark.kind) this.#take(String(mark.kind));
    this.#editor?.set(mark);
    this.#on.changed();
  }

  /**
   * Have the target marked in another way.
   *
   * @param {string|undefined} kind
   */
  #take(kind) {
    const { marks, target } = this.#experiment;
    const description = marks.find((each) => each.kind === kind);
    if (description === undefined) {
      [this.#picture.width, this.#picture.height] = [this.#upload.width, this.#upload.height];
      fill(this.#root, h("p", { class: "hint" }, this.#experiment.advice), this.#picture);
      return;
    }
    this.#editor = markEditor(description, target, this.#on.changed);
    const leave = this.#isOptional && " Leave them unchanged if the whole recording is the target.";
    const words = h("p", { class: "hint" }, description.instruction, " ", this.#experiment.advice, leave);
    fill(this.#root, marks.length > 1 && this.#choice(kind), words, this.#editor.element);
    this.show(this.#frame);
    this.#editor.offer();
    this.#on.changed();
  }

  /** @param {string|undefined} kind */
  #choice(kind) {
    const choice = h("select", {}, this.#experiment.marks.map((mark) => h("option", { value: mark.kind, selected: mark.kind === kind }, mark.title)));
    choice.addEventListener("change", () => this.#take(choice.value));
    return h("label", { class: "mark-choice" }, "Mark the target by ", choice);
  }
}
