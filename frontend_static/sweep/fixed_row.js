/** One parameter of a plan that has the same value in all runs. */

import { fill, h } from "../shared/dom.js";
import { parameterSelect, valueInput, wrong } from "./fields.js";

export class FixedRow {
  #declarations;
  #on;
  /** @type {ReturnType<typeof valueInput>} */
  #input;
  element = h("div", { class: "fixed" });

  /**
   * @param {import("../shared/messages.js").Declaration[]} declarations The experiment's parameters.
   * @param {string} name
   * @param {unknown} value The default if undefined.
   * @param {{changed: () => void, remove: () => void}} on
   */
  constructor(declarations, name, value, on) {
    this.#declarations = declarations;
    this.#on = on;
    this.name = declarations.some((declaration) => declaration.name === name) ? name : declarations[0].name;
    this.#input = this.#draw(value);
  }

  read() {
    return this.#input.read();
  }

  /**
   * @param {unknown} [value]
   * @returns {ReturnType<typeof valueInput>}
   */
  #draw(value) {
    const declaration = this.#declarations.find(({ name }) => name === this.name) ?? this.#declarations[0];
    this.element.dataset.field = `parameters.${this.name}`;
    const input = valueInput(declaration, value, this.#on.changed);
    const choose = parameterSelect("Fixed parameter", this.#declarations, this.name, (chosen) => {
      this.name = chosen;
      this.#input = this.#draw();
      this.#on.changed();
    });
    const remove = h("button", { type: "button", class: "quiet", on: { click: this.#on.remove } }, "Remove");
    fill(this.element, h("div", { class: "fixed-line" }, choose, input.element, remove), h("p", { class: "hint" }, declaration.description), wrong());
    return input;
  }
}
