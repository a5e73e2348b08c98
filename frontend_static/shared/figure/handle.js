/**
 * Lines across a panel at values: handles, which are moved by pointer, touch or keys; the one with which a person says where
 * they expect the answer; and the marks of what was predicted and what is exact.
 */

import { build, setText } from "../dom.js";
import { ends, even, valueOn } from "./axes.js";

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
    const { box, scales, axis, along, bounds, title, locked } = this.#stand;
    const at = scales[along].at(this.#value);
    const { element } = this;
    const words = valueOn(axis, this.#value, bounds.log ? undefined : bounds.step);
    put(element, box, along, at);
    setText(this.#flag, `${title} ${words}`.trim());
    const texts = { label: title || axis.title, valuemin: bounds.low, valuemax: bounds.high, valuenow: this.#value, valuetext: words };
    for (const [name, text] of Object.entries({ ...texts, orientation: along === "x" ? "horizontal" : "vertical", disabled: locked })) {
      element.setAttribute(`aria-${name}`, String(text));
    }
  }
}

/** @typedef {{box: Box, scales: {x: Scale, y: Scale}, axes: {x: Axis, y: Axis}, along: "x"|"y"}} Asked */

/** Asking for a place in a panel: a person puts a line where they expect the answer, by pointer, touch or keys. */
export class PlaceQuestion {
  #grip = new Handle((value) => this.#put(value), "asking");
  #hint = build("p", { class: "figure-hint", "aria-hidden": "true" }, build("span", {}, "Place your prediction here"));
  #place;
  /** @type {Asked|null} */
  #asked = null;
  /** @type {number|null} */
  #at = null;
  /** The other coordinate of the pointer; it does not count, and is handed on.
   *
   * @type {number|null} */
  #beside = null;

  element = build("div", { class: "figure-asking", hidden: true }, this.#hint, this.#grip.element);

  /** @param {(x: number, y: number) => void} place Told both coordinates. */
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
    return { box, scales, axis: axes[along], along, at, bounds: boundsOf(axes[along]), title: "your prediction", locked: false };
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

/** @typedef {{panel: string, along: "x"|"y", at: number|null, exact: number|null}} Mark What was placed, and what is exact. */

/**
 * What is said of a mark.
 *
 * @param {Mark} mark
 * @param {Axis} axis
 */
export function wordsOf({ at, exact }, axis) {
  const words = [];
  if (at !== null) words.push(`your prediction ${valueOn(axis, at)}`);
  if (exact !== null) words.push(`exactly ${valueOn(axis, exact)}`);
  return words.join(", ");
}

/**
 * @param {Mark} mark
 * @param {Axis} axis
 * @param {Scale} scale
 * @param {Box} box
 */
export function markLines({ along, at, exact }, axis, scale, box) {
  const both = at !== null && exact !== null;
  const placed = at !== null && one("placed", "your prediction", at);
  const right = exact !== null && one("exact", "exactly", exact);
  return [placed, right].filter((element) => element !== false);

  /**
   * @param {string} name
   * @param {string} title
   * @param {number} value
   */
  function one(name, title, value) {
    const flag = build("span", { class: "figure-flag" }, `${title} ${valueOn(axis, value)}`);
    const isSecond = both && name === "exact";
    const line = build("div", { class: `figure-mark ${name}`, "aria-hidden": "true", "data-second": isSecond }, flag);
    put(line, box, along, scale.at(value));
    return line;
  }
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
  for (const [side, px] of Object.entries(place)) line.style.setProperty(side, `${px}px`);
  line.dataset.along = along;
  // What is written beside it stays within the panel.
  line.toggleAttribute("data-far", along === "x" ? at > left + width / 2 : at < top + height / 2);
}
