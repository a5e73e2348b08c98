/** Asking for a place in a panel: a person puts a line where they expect the answer, by pointer, touch or keys. */

import { h } from "../dom.js";
import { Handle, boundsOf, stepped } from "./handle.js";

/** @import { Box } from "./box.js" */
/** @import { Scale } from "./scale.js" */
/** @import { Axis } from "./traces.js" */

/** @typedef {{box: Box, scales: {x: Scale, y: Scale}, axes: {x: Axis, y: Axis}, along: "x"|"y"}} Asked */

const TITLE = "your prediction";

export class PlaceQuestion {
  #grip = new Handle((value) => this.#put(value), "asking");
  #hint = h("p", { class: "figure-hint", "aria-hidden": "true" }, h("span", {}, "Place your prediction here"));
  #place;
  /** @type {Asked|null} */
  #asked = null;
  /** @type {number|null} */
  #at = null;
  /** The other coordinate of the pointer; it does not count, and is handed on.
   *
   * @type {number|null} */
  #beside = null;

  element = h("div", { class: "figure-asking", hidden: true }, this.#hint, this.#grip.element);

  /** @param {(x: number, y: number) => void} place */
  constructor(place) {
    this.#place = place;
    this.element.addEventListener("pointerdown", (event) => {
      if (this.#asked === null || event.target !== this.element) return;
      this.#aside(event);
      // Its old place must not pass for a new one.
      this.#grip.show(this.#stand(NaN));
      this.#grip.hold(event);
    });
    this.#grip.element.addEventListener("keydown", (event) => {
      if (this.#asked === null || (event.key !== "Enter" && event.key !== " ")) return;
      event.preventDefault();
      this.#put(this.#at ?? stepped(this.#middle, boundsOf(this.#asked.axes[this.#asked.along])));
    });
  }

  /** @param {Asked|null} asked Null takes it away, and forgets what was placed. */
  show(asked) {
    this.#asked = asked;
    this.element.hidden = asked === null;
    if (asked === null) {
      this.#at = this.#beside = null;
      return;
    }
    this.element.dataset.along = asked.along;
    const { left, top, width, height } = asked.box;
    Object.assign(this.#hint.style, { left: `${left}px`, top: `${top}px`, width: `${width}px`, height: `${height}px` });
    this.#grip.show(this.#stand(this.#at ?? this.#middle));
    this.#say();
  }

  get #middle() {
    const { scales, along, box } = /** @type {Asked} */ (this.#asked);
    return scales[along].value(along === "x" ? box.left + box.width / 2 : box.top + box.height / 2);
  }

  /** @param {number} at */
  #stand(at) {
    const { box, scales, axes, along } = /** @type {Asked} */ (this.#asked);
    return { box, scales, axis: axes[along], along, at, bounds: boundsOf(axes[along]), title: TITLE, locked: false };
  }

  /** @param {PointerEvent} event */
  #aside({ clientX, clientY }) {
    const { scales, along } = /** @type {Asked} */ (this.#asked);
    const around = this.element.getBoundingClientRect();
    this.#beside = along === "x" ? scales.y.value(clientY - around.top) : scales.x.value(clientX - around.left);
  }

  /** @param {number} value */
  #put(value) {
    if (this.#asked === null) return;
    const { along, scales, box } = this.#asked;
    this.#at = value;
    this.#say();
    const middle = along === "x" ? scales.y.value(box.top + box.height / 2) : scales.x.value(box.left + box.width / 2);
    const beside = this.#beside ?? middle;
    this.#place(along === "x" ? value : beside, along === "x" ? beside : value);
  }

  #say() {
    const isPlaced = this.#at !== null;
    this.element.toggleAttribute("data-placed", isPlaced);
    if (!isPlaced) this.#grip.element.setAttribute("aria-valuetext", "not placed yet");
  }
}
