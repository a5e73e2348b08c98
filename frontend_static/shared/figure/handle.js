/**
 * A line across a panel that stands at a value and is moved by pointer, touch or keys. While somebody holds it, it stands
 * where they put it; afterwards where it is told to stand.
 */

import { h, setText } from "../dom.js";
import { even } from "./ticks.js";
import { valueOn } from "./description.js";

/** @import { Box } from "./box.js" */
/** @import { Scale } from "./scale.js" */
/** @import { Axis } from "./traces.js" */

/**
 * @typedef {object} Bounds What a grip may be moved to.
 * @property {number} low
 * @property {number} high
 * @property {number} step In decades where it is logarithmic.
 * @property {boolean} log
 */

/**
 * Where a grip stands, and over what.
 *
 * @typedef {object} Stand
 * @property {Box} box
 * @property {{x: Scale, y: Scale}} scales
 * @property {Axis} axis
 * @property {"x"|"y"} along
 * @property {number} at
 * @property {Bounds} bounds
 * @property {string} title
 * @property {boolean} locked
 */

/** Of an axis, where a parameter says no other. */
const STEPS = 400;
const FAR = 10;
/** @type {Record<string, number>} */
const MOVES = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1, PageDown: -FAR, PageUp: FAR };

export class Handle {
  #flag = h("span", { class: "figure-flag", "aria-hidden": "true" });
  #tell;
  /** @type {Stand|null} */
  #stand = null;
  #value = NaN;
  #held = false;
  #beside = 0;

  element = h("div", { class: "figure-grip", role: "slider", tabindex: 0 }, h("span", { class: "figure-knob" }), this.#flag);

  /**
   * @param {(value: number) => void} tell Told each value once.
   * @param {string} [name] A class of its own.
   */
  constructor(tell, name) {
    this.#tell = tell;
    if (name) this.element.classList.add(name);
    // What nobody moves here is a line, and none of the ways through the page leads to it.
    if (name === "fixed") this.element.removeAttribute("tabindex");
    const { element } = this;
    // Taken a little beside its line, it does not jump to the pointer.
    element.addEventListener("pointerdown", (event) => this.hold(event, this.#off(event)));
    element.addEventListener("pointermove", (event) => {
      if (element.hasPointerCapture(event.pointerId)) this.#follow(event);
    });
    for (const type of ["pointerup", "pointercancel", "lostpointercapture", "blur", "keyup"]) element.addEventListener(type, () => this.#release());
    element.addEventListener("keydown", (event) => this.#key(event));
  }

  /** @param {Stand} stand */
  show(stand) {
    this.#stand = stand;
    if (!this.#held) this.#value = stand.at;
    this.#draw();
  }

  /**
   * Take it with a pointer that went down in the panel, and put it there.
   *
   * @param {PointerEvent} event
   * @param {number} [off] How far beside it the pointer stays, px.
   */
  hold(event, off = 0) {
    if (this.#stand === null || this.#stand.locked || event.button !== 0) return;
    event.preventDefault();
    this.element.focus({ preventScroll: true });
    this.element.setPointerCapture(event.pointerId);
    this.#held = true;
    this.#beside = off;
    this.element.toggleAttribute("data-held", true);
    this.#follow(event);
  }

  /**
   * How far from it a pointer is, px.
   *
   * @param {PointerEvent} event
   */
  #off(event) {
    if (this.#stand === null) return 0;
    const { along, scales } = this.#stand;
    return this.#px(event, along) - scales[along].at(this.#value);
  }

  /**
   * @param {PointerEvent} event
   * @param {"x"|"y"} along
   */
  #px(event, along) {
    const around = /** @type {HTMLElement} */ (this.element.parentElement).getBoundingClientRect();
    return along === "x" ? event.clientX - around.left : event.clientY - around.top;
  }

  #release() {
    this.#held = false;
    this.element.removeAttribute("data-held");
  }

  /** @param {PointerEvent} event */
  #follow(event) {
    if (this.#stand === null) return;
    const { along, scales, bounds } = this.#stand;
    this.#go(stepped(scales[along].value(this.#px(event, along) - this.#beside), bounds));
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    if (this.#stand === null || this.#stand.locked || event.ctrlKey || event.metaKey || event.altKey) return;
    const { bounds } = this.#stand;
    const move = MOVES[event.key];
    if (move) this.#go(moved(this.#value, move * (event.shiftKey ? FAR : 1), bounds));
    else if (event.key === "Home") this.#go(bounds.low);
    else if (event.key === "End") this.#go(bounds.high);
    else return;
    this.#held = true;
    event.preventDefault();
    event.stopPropagation();
  }

  /** @param {number} value */
  #go(value) {
    if (value === this.#value || !Number.isFinite(value)) return;
    this.#value = value;
    this.#draw();
    this.#tell(value);
  }

  #draw() {
    if (this.#stand === null) return;
    const { box, scales, axis, along, bounds, title, locked } = this.#stand;
    const at = scales[along].at(this.#value);
    const { element } = this;
    const words = valueOn(axis, this.#value, bounds.log ? undefined : bounds.step);
    element.dataset.along = along;
    const place = along === "x" ? { left: at, top: box.top, height: box.height, width: 0 } : { left: box.left, top: at, width: box.width, height: 0 };
    for (const [side, px] of Object.entries(place)) element.style.setProperty(side, `${px}px`);
    // What is written beside it stays within the panel.
    const isFar = along === "x" ? at > box.left + box.width / 2 : at < box.top + box.height / 2;
    element.toggleAttribute("data-far", isFar);
    setText(this.#flag, `${title} ${words}`.trim());
    const texts = { label: title || axis.title, valuemin: bounds.low, valuemax: bounds.high, valuenow: this.#value, valuetext: words };
    for (const [name, text] of Object.entries({ ...texts, orientation: along === "x" ? "horizontal" : "vertical", disabled: locked })) {
      element.setAttribute(`aria-${name}`, String(text));
    }
  }
}

/**
 * Values that a handle may take: those of its parameter that are on the axis, or all of the axis.
 *
 * @param {Axis} axis
 * @param {{minimum: number|null, maximum: number|null, step: number|null}} [declared]
 * @returns {Bounds}
 */
export function boundsOf(axis, declared) {
  const [low, high] = [Math.min(axis.low, axis.high), Math.max(axis.low, axis.high)];
  const { minimum, maximum, step } = declared ?? {};
  if (!step) return { low, high, step: even(axis.log ? { low: Math.log10(low), high: Math.log10(high) } : axis, STEPS).step, log: axis.log };
  const start = minimum ?? low;
  const first = start + Math.max(0, Math.ceil((low - start) / step)) * step;
  return { low: first, high: Math.max(first, Math.min(maximum ?? high, high)), step, log: false };
}

/**
 * The nearest value that the bounds allow. Steps are counted from the lowest, as a slider of a page counts them.
 *
 * @param {number} value
 * @param {Bounds} bounds
 */
export function stepped(value, { low, high, step, log }) {
  const [bent, bentLow] = log ? [Math.log10(value), Math.log10(low)] : [value, low];
  const whole = bentLow + Math.round((bent - bentLow) / step) * step;
  return Number(Math.min(Math.max(log ? 10 ** whole : whole, low), high).toPrecision(log ? 4 : 12));
}

/**
 * The value so many steps on.
 *
 * @param {number} value
 * @param {number} steps
 * @param {Bounds} bounds
 */
export function moved(value, steps, bounds) {
  return stepped(bounds.log ? value * 10 ** (steps * bounds.step) : value + steps * bounds.step, bounds);
}
