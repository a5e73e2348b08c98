/**
 * Lines across a panel at values: handles, which are moved by pointer, touch or keys; the one with which a person says where
 * they expect the answer; and the marks of what was predicted and what is exact.
 */

import { build, setText } from "../dom.js";
import { ends, even, inPx, valueOn } from "./axes.js";

/** @import { Box, Scale } from "./axes.js" */
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
 * @property {Scale} scale
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

/** While somebody holds it, it stands where they put it; afterwards where it is told to stand. */
export class Handle {
  #flag = build("span", { class: "figure-flag", "aria-hidden": "true" });
  #tell;
  /** @type {Stand|null} */
  #stand = null;
  #value = NaN;
  #held = false;
  #beside = 0;

  element = build("div", { class: "figure-grip", role: "slider", tabindex: 0 }, build("span", { class: "figure-knob" }), this.#flag);

  /**
   * @param {(value: number) => void} tell Told each value once.
   * @param {string} [name] A class of its own.
   */
  constructor(tell, name) {
    this.#tell = tell;
    if (name) this.element.classList.add(name);
    // A handle that cannot be moved is a line, and the Tab key passes it over.
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
    return this.#stand === null ? 0 : this.#px(event, this.#stand) - this.#stand.scale.at(this.#value);
  }

  /**
   * @param {PointerEvent} event
   * @param {Stand} stand
   */
  #px(event, { along }) {
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
    const { scale, bounds } = this.#stand;
    this.#go(stepped(scale.value(this.#px(event, this.#stand) - this.#beside), bounds));
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    if (this.#stand === null || this.#stand.locked || event.ctrlKey || event.metaKey || event.altKey) return;
    const { along, axis, bounds } = this.#stand;
    const move = MOVES[event.key] * (event.shiftKey ? FAR : 1);
    // Up is up, also where the axis goes down.
    const way = along === "y" && axis.high < axis.low ? -1 : 1;
    if (move) this.#go(moved(this.#value, way * move, bounds));
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
    const { box, scale, axis, along, bounds, title, locked } = this.#stand;
    const { element } = this;
    const words = valueOn(axis, this.#value, bounds.log ? undefined : bounds.step);
    put(element, box, along, scale.at(this.#value));
    setText(this.#flag, `${title} ${words}`.trim());
    const texts = { label: title || axis.title, valuemin: bounds.low, valuemax: bounds.high, valuenow: this.#value, valuetext: words };
    for (const [name, text] of Object.entries({ ...texts, orientation: along === "x" ? "horizontal" : "vertical", disabled: locked })) {
      element.setAttribute(`aria-${name}`, String(text));
    }
  }
}

/** Asking for a place in a panel: a person puts a line where they expect the answer, by pointer, touch or keys. */
export class PlaceQuestion {
  #grip = new Handle((value) => this.#put(value), "asking");
  #hint = build("p", { class: "figure-hint", "aria-hidden": "true" }, build("span", {}, "Place your prediction here"));
  #place;
  /** @type {Stand|null} */
  #stand = null;
  /** @type {number|null} */
  #at = null;

  element = build("div", { class: "figure-asking", hidden: true }, this.#hint, this.#grip.element);

  /** @param {(value: number) => void} place */
  constructor(place) {
    this.#place = place;
    this.element.addEventListener("pointerdown", (event) => {
      if (this.#stand === null || event.target !== this.element) return;
      // Its old place must not pass for a new one.
      this.#grip.show({ ...this.#stand, at: NaN });
      this.#grip.hold(event);
    });
    this.#grip.element.addEventListener("keydown", (event) => {
      if (this.#stand === null || (event.key !== "Enter" && event.key !== " ")) return;
      event.preventDefault();
      this.#put(this.#at ?? stepped(this.#stand.at, this.#stand.bounds));
    });
  }

  /** @param {Stand|null} stand Where the line is at first; null takes it away, and forgets what was placed. */
  show(stand) {
    this.#stand = stand;
    this.element.hidden = stand === null;
    if (stand === null) {
      this.#at = null;
      return;
    }
    this.element.dataset.along = stand.along;
    Object.assign(this.#hint.style, inPx(stand.box));
    this.#grip.show({ ...stand, at: this.#at ?? stand.at });
    this.#say();
  }

  /** @param {number} value */
  #put(value) {
    this.#at = value;
    this.#say();
    this.#place(value);
  }

  #say() {
    const isPlaced = this.#at !== null;
    this.element.toggleAttribute("data-placed", isPlaced);
    if (!isPlaced) this.#grip.element.setAttribute("aria-valuetext", "not placed yet");
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
  const [low, high] = ends(axis);
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

/** @typedef {{panel: string, along: "x"|"y", at: number, exact: number}} Mark What was placed, and what is exact. */

/**
 * What is said of a mark.
 *
 * @param {Mark} mark
 * @param {Axis} axis
 */
export function wordsOf({ at, exact }, axis) {
  return `your prediction ${valueOn(axis, at)}, exactly ${valueOn(axis, exact)}`;
}

/**
 * @param {Mark} mark
 * @param {Axis} axis
 * @param {Scale} scale
 * @param {Box} box
 */
export function markLines({ along, at, exact }, axis, scale, box) {
  const both = /** @type {const} */ ([["placed", "your prediction", at], ["exact", "exactly", exact]]);
  return both.map(([name, title, value]) => {
    const flag = build("span", { class: "figure-flag" }, `${title} ${valueOn(axis, value)}`);
    const line = build("div", { class: `figure-mark ${name}`, "aria-hidden": "true" }, flag);
    put(line, box, along, scale.at(value));
    return line;
  });
}

/**
 * Put a line across a box.
 *
 * @param {HTMLElement} line
 * @param {Box} box
 * @param {"x"|"y"} along
 * @param {number} at px
 */
function put(line, { left, top, width, height }, along, at) {
  const place = along === "x" ? { left: at, top, height, width: 0 } : { left, top: at, width, height: 0 };
  Object.assign(line.style, inPx(place));
  line.dataset.along = along;
  // What is written beside it stays within the panel.
  line.toggleAttribute("data-far", along === "x" ? at > left + width / 2 : at < top + height / 2);
}
