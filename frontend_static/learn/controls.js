/** What can be turned in a lesson: each control with a way back to where it was, and the seed with a way to a new draw. */

import { makeControl, numberBox } from "../session/panel/control.js";
import { fill, h } from "../shared/dom.js";
import { iconButton } from "../shared/icons.js";

/** @import { Declaration } from "../shared/messages.js" */
/** @import { Value } from "../shared/format.js" */
/** @import { Control } from "../session/panel/control.js" */

export const SEED = "seed";
const SEED_HINT = "The same seed gives the same random numbers, to the bit.";

/**
 * @typedef {object} Turnable
 * @property {string} name
 * @property {string} title
 * @property {(propose: (value: Value) => void) => Control} make
 */

export class Controls {
  /** @type {Map<string, Control>} */
  #controls = new Map();
  #fields;

  /**
   * @param {HTMLElement} place
   * @param {readonly Turnable[]} turnables
   * @param {{propose: (name: string, value: Value) => void, reset: (name: string) => void, draw?: () => void}} on
   */
  constructor(place, turnables, on) {
    const cells = turnables.map(({ name, title, make }) => {
      const control = make((value) => on.propose(name, value));
      this.#controls.set(name, control);
      const back = iconButton("replay", `Reset ${title}`, () => on.reset(name));
      return h("div", { class: "lesson-control", data: { control: name } }, control.element, back);
    });
    const draw = on.draw && h("button", { type: "button", title: "Other random numbers (D)", data: { role: "draw" }, on: { click: on.draw } }, "New draw");
    this.#fields = h("fieldset", { class: "lesson-fields", "aria-label": "Controls" }, cells, draw);
    fill(place, this.#fields);
    place.hidden = turnables.length === 0 && !on.draw;
  }

  /** @param {boolean} isLocked Whether they wait for an answer. */
  lock(isLocked) {
    this.#fields.disabled = isLocked;
  }

  /**
   * Show what is in force.
   *
   * @param {Record<string, Value>} values
   * @param {(name: string) => boolean} [isHeld] Whether it is in somebody's hand.
   */
  show(values, isHeld = () => false) {
    for (const [name, control] of this.#controls) if (name in values && !isHeld(name)) control.show(values[name]);
  }
}

/**
 * The controls of declared parameters, in order.
 *
 * @param {readonly Declaration[]} declarations
 * @param {Record<string, Value>} values In force; a parameter without one has no control.
 * @returns {Turnable[]}
 */
export function declared(declarations, values) {
  return declarations.flatMap((declaration) => {
    const { name, title } = declaration;
    return name in values ? [{ name, title, make: (propose) => makeControl(declaration, values[name], propose) }] : [];
  });
}

/** @type {Turnable} */
export const seedControl = { name: SEED, title: "Seed", make: (propose) => numberBox("Seed", SEED_HINT, { min: 0 }, propose) };
