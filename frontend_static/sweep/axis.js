/** One axis of a plan: a parameter, and from where to where in which steps, or a list of its values. */

import { fill, h, setText } from "../shared/dom.js";
import { axisInputs, isNumerical } from "./axis_inputs.js";
import { allowed, parameterSelect, wrong } from "./fields.js";

/** @import { Declaration, EstimatePublic, SweepAxis } from "../shared/messages.js" */
/** @import { Form, Inputs } from "./axis_inputs.js" */

const PREVIEWED = 12;

export class AxisRow {
  #declarations;
  #on;
  /** @type {Declaration} */
  #declaration;
  /** @type {Form} */
  #form;
  /** @type {Inputs} */
  #inputs;
  /** Its place among the axes, and whether it may be removed; both are told by whoever has the axes. */
  #place = 0;
  #isRemovable = true;
  #words = h("p", { class: "hint" });
  element = h("div", { class: "axis", role: "group" });

  /**
   * @param {Declaration[]} declarations The experiment's parameters.
   * @param {SweepAxis} given What the axis is at first.
   * @param {{changed: () => void, remove: () => void}} on
   */
  constructor(declarations, given, on) {
    this.#declarations = declarations;
    this.#on = on;
    this.#declaration = this.#named(given.name);
    this.#form = given.values ? "list" : "range";
    this.#inputs = this.#draw(given);
  }

  /** Name of the parameter. */
  get name() {
    return this.#declaration.name;
  }

  /**
   * What is asked for now.
   *
   * @returns {SweepAxis}
   */
  read() {
    return { name: this.name, ...this.#inputs.read() };
  }

  /**
   * Tell it its place, by which the server names what is wrong with it.
   *
   * @param {number} place
   * @param {boolean} isRemovable
   */
  number(place, isRemovable) {
    const isSame = place === this.#place && isRemovable === this.#isRemovable;
    this.#place = place;
    this.#isRemovable = isRemovable;
    this.#label();
    if (!isSame) this.#inputs = this.#draw(this.#inputs.read());
  }

  /**
   * Say which values these are.
   *
   * @param {EstimatePublic} estimate
   */
  preview(estimate) {
    const found = estimate.axes[this.#place];
    if (found?.name !== this.name) return;
    const { unit } = this.#declaration;
    const shown = found.first.slice(0, PREVIEWED).join(", ");
    const more = found.count > PREVIEWED ? ", …" : "";
    const values = `${found.count} ${found.count === 1 ? "value" : "values"}: ${shown}${more}${unit ? ` ${unit}` : ""}.`;
    setText(this.#words, [values, allowed(this.#declaration)].filter(Boolean).join(" "));
  }

  /** @param {string} name */
  #named(name) {
    return this.#declarations.find((declaration) => declaration.name === name) ?? this.#declarations[0];
  }

  /**
   * @param {Omit<SweepAxis, "name">} given
   * @returns {Inputs}
   */
  #draw(given) {
    const inputs = axisInputs(this.#declaration, this.#form, given, this.#on.changed);
    const { remove } = this.#on;
    fill(
      this.element,
      h(
        "div",
        { class: "axis-head" },
        this.#chooser(),
        isNumerical(this.#declaration) && h("span", { class: "segments" }, this.#switch("range", "Range"), this.#switch("list", "List")),
        this.#isRemovable && h("button", { type: "button", class: "quiet", on: { click: remove } }, "Remove"),
      ),
      inputs.element,
      wrong(),
      this.#words,
    );
    setText(this.#words, [this.#declaration.description, allowed(this.#declaration)].filter(Boolean).join(" "));
    for (const [name, input] of Object.entries(inputs.fields)) input.dataset.field = `axes.${this.#place}.${name}`;
    this.#label();
    return inputs;
  }

  #label() {
    this.element.dataset.field = `axes.${this.#place}`;
    this.element.setAttribute("aria-label", `Axis ${this.#place + 1}`);
  }

  #chooser() {
    const choose = parameterSelect("Varied parameter", this.#declarations, this.name, (name) => {
      this.#declaration = this.#named(name);
      this.#form = "range";
      this.#inputs = this.#draw({});
      this.#on.changed();
    });
    choose.dataset.field = `axes.${this.#place}.name`;
    return choose;
  }

  /**
   * A button for one of the two forms.
   *
   * @param {Form} form
   * @param {string} text
   */
  #switch(form, text) {
    const press = () => {
      if (this.#form === form) return;
      this.#form = form;
      this.#inputs = this.#draw(this.#inputs.read());
      this.#on.changed();
    };
    return h("button", { type: "button", "aria-pressed": String(this.#form === form), on: { click: press } }, text);
  }
}
