/** A number of a mark: a slider with its unit, within its bounds. */

import { h, setText } from "../dom.js";
import { parameterValue } from "../format.js";

export class NumberField {
  #number;
  #slider;
  #words = h("output", {});

  /**
   * @param {import("../messages.js").MarkNumber} number
   * @param {() => void} changed Called when a person has moved it.
   */
  constructor(number, changed) {
    const { name, title, minimum, maximum, step } = number;
    this.#number = number;
    this.#slider = h("input", { type: "range", min: minimum, max: maximum, step, data: { number: name } });
    this.#slider.addEventListener("input", () => {
      this.#say();
      changed();
    });
    this.element = h("label", { class: "mark-number" }, h("span", {}, title, " ", this.#words), this.#slider);
    this.value = number.default;
  }

  /** Its path in the mark. */
  get name() {
    return this.#number.name;
  }

  /** What it is at first. */
  get first() {
    return this.#number.default;
  }

  /** The handle about which it is a radius, if it is one. */
  get about() {
    return this.#number.about;
  }

  get value() {
    return Number(this.#slider.value);
  }

  set value(value) {
    this.#slider.value = String(value);
    this.#say();
  }

  #say() {
    setText(this.#words, parameterValue(this.value, this.#number));
  }
}
