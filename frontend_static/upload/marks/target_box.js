/** The box of a target that a person has to show. */

import { api } from "../../shared/api.js";
import { BoxEditor } from "./box_editor.js";

export class BoxTarget {
  #upload;
  #editor;
  #frame = 0;

  /**
   * @param {HTMLElement} root
   * @param {object} upload
   * @param {{changed: () => void}} on
   */
  constructor(root, upload, on) {
    this.#upload = upload;
    this.#editor = new BoxEditor(root, () => on.changed());
  }

  /** What a session is told of the target, or null while there is nothing to tell. */
  get footage() {
    const { mark } = this.#editor;
    return mark && { mark, start: this.#frame };
  }

  /** Show a frame; the box stays. */
  show(frame) {
    this.#frame = frame;
    this.#editor.show(api.pictureAddress(this.#upload.id, frame), this.#upload.width, this.#upload.height);
  }

  /** Nothing is found by itself. */
  find() {}

  focus() {
    this.#editor.focus();
  }

  leave() {}
}
