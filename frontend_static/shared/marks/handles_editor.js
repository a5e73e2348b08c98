/**
 * An editor of any mark that consists of handles and numbers: a handle is dragged by mouse or touch, or moved by keyboard
 * (Tab goes through the handles, arrows move one by 1 px, shift+arrows by 10); a number has a slider, and one that is a
 * radius a circle whose edge can be dragged. Handles are in pixels of the picture and never leave it.
 */

import { h, setText, svg } from "../dom.js";
import { Loupe } from "./loupe.js";
import { linesOf, markOf, valueAt } from "./mark_json.js";
import { NumberField } from "./number_field.js";
import { Picture, arrow } from "./picture.js";

/** @import { Description, Mark } from "./mark_json.js" */

/** @typedef {[number, number]} Place */

const REACH_PX = 28;
const EDGE_PX = 10;
const FAR = 10;
/** So much room the longest name takes. */
const NAME_PX = 180;

export class HandlesEditor {
  #description;
  #changed;
  /** @type {{ends: [string, string], drawn: SVGElement[]}[]} */
  #lines;
  /** @type {{number: NumberField, drawn: SVGElement[]}[]} */
  #circles;
  #numbers;
  #handles;
  #picture;
  #loupe = new Loupe();
  #words = h("output", { class: "picture-words", "aria-live": "polite" });
  /** Whether there is a mark: one was set, or a person has begun to make one. */
  #isMade = false;
  /** @type {Map<string, Place>} */
  #places = new Map();
  /** @type {Set<string>} */
  #placed = new Set();
  /**
   * Handles that still stand where they were offered; their names are shown.
   *
   * @type {Set<string>}
   */
  #offered = new Set();
  /** @type {{handle: string, grip: Place}|{radius: NumberField}|null} */
  #drag = null;

  /**
   * @param {Description} description
   * @param {string} target What is marked.
   * @param {() => void} changed Called when a person has changed the mark.
   */
  constructor(description, target, changed) {
    this.#description = description;
    this.#changed = changed;
    this.#lines = linesOf(description).map((ends) => ({ ends, drawn: ["halo", "line"].map((part) => svg("line", { class: `mark-${part}` })) }));
    this.#numbers = description.numbers.map((number) => new NumberField(number, () => this.#touched()));
    const radii = this.#numbers.filter(({ about }) => about !== null);
    this.#circles = radii.map((number) => ({ number, drawn: ["halo", "line"].map((part) => svg("circle", { class: `mark-${part}` })) }));
    this.#handles = new Map(description.handles.map(({ name, title }) => [name, this.#handle(name, title)]));
    const drawn = [...this.#circles, ...this.#lines].flatMap((each) => each.drawn);
    const properties = { class: "mark-surface", role: "group", "aria-label": `${description.title}, ${target}` };
    this.#picture = new Picture(properties, drawn, () => this.#draw());
    const surface = this.#picture.element;
    surface.append(...this.#handles.values(), this.#loupe.element);
    surface.addEventListener("pointerdown", (event) => this.#press(event));
    surface.addEventListener("pointermove", (event) => this.#move(event));
    surface.addEventListener("pointerleave", () => this.#name(null));
    for (const end of ["pointerup", "pointercancel"]) surface.addEventListener(end, () => this.#release());
    this.element = h("div", { class: "target-stage", data: { mark: description.kind } }, surface, this.#words, this.#numbers.map(({ element }) => element));
  }

  get mark() {
    if (!this.#isMade) return null;
    const numbers = this.#numbers.map(({ name, value }) => /** @type {[string, unknown]} */ ([name, value]));
    return markOf(this.#description.kind, [...this.#places, ...numbers]);
  }

  /** How many handles still stand where they were offered. */
  get left() {
    return this.#offered.size;
  }

  /**
   * @param {Mark|null} mark
   * @param {string[]} [placed]
   */
  set(mark, placed = []) {
    this.#isMade = mark !== null;
    this.#places.clear();
    for (const { name } of this.#description.handles) {
      const place = valueAt(mark, name);
      if (isPlace(place)) this.#places.set(name, [place[0], place[1]]);
    }
    this.#placed = new Set(placed);
    this.#offered.clear();
    for (const number of this.#numbers) number.value = Number(valueAt(mark, number.name) ?? number.first);
    this.#draw();
  }

  /** Show the handles where the kind has them at first, to be dragged to where they belong. */
  offer() {
    const { width, height } = this.#picture;
    this.set(null);
    this.#places = new Map(this.#description.handles.map(({ name, at }) => [name, [at[0] * (width - 1), at[1] * (height - 1)]]));
    this.#offered = new Set(this.#places.keys());
    this.#draw();
  }

  /**
   * @param {string} address
   * @param {number} width
   * @param {number} height
   */
  show(address, width, height) {
    this.#picture.show(address, width, height);
    this.#draw();
  }

  focus() {
    this.#handles.values().next().value?.focus({ preventScroll: true });
  }

  /**
   * @param {string} name
   * @param {string} title
   */
  #handle(name, title) {
    const handle = h("button", { type: "button", class: "point", data: { handle: name } }, h("span", { class: "point-name" }, title));
    handle.addEventListener("focus", () => this.#say(name));
    handle.addEventListener("blur", () => {
      this.#loupe.hide();
      this.#say(null);
    });
    handle.addEventListener("keydown", (event) => {
      const way = arrow(event);
      const place = this.#places.get(name);
      if (way === null || place === undefined) return;
      event.preventDefault();
      event.stopPropagation();
      const far = event.shiftKey ? FAR : 1;
      this.#put(name, place[0] + far * way[0], place[1] + far * way[1]);
    });
    return handle;
  }

  /**
   * The handle nearest to a place, if it is within reach.
   *
   * @param {Place} place
   */
  #near([x, y]) {
    /** @type {string|null} */
    let nearest = null;
    let least = REACH_PX * this.#picture.scale;
    for (const [name, [u, v]] of this.#places) {
      const away = Math.hypot(u + 0.5 - x, v + 0.5 - y);
      if (away < least) [nearest, least] = [name, away];
    }
    return nearest;
  }

  /**
   * The radius whose circle passes near a place.
   *
   * @param {Place} place
   */
  #edge([x, y]) {
    const reach = EDGE_PX * this.#picture.scale;
    return this.#circles.find(({ number }) => {
      const centre = this.#places.get(number.about ?? "");
      return centre && Math.abs(Math.hypot(centre[0] + 0.5 - x, centre[1] + 0.5 - y) - number.value) <= reach;
    })?.number;
  }

  /** @param {PointerEvent} event */
  #press(event) {
    if (event.button !== 0) return;
    const at = this.#picture.at(event);
    event.preventDefault();
    const radius = this.#edge(at);
    const name = this.#near(at);
    const place = name === null ? undefined : this.#places.get(name);
    if (name !== null && place !== undefined) {
      this.#drag = { handle: name, grip: [at[0] - place[0], at[1] - place[1]] };
      this.#handles.get(name)?.focus({ preventScroll: true });
      this.#magnify(name);
    } else if (radius) {
      this.#drag = { radius };
    } else {
      return;
    }
    this.#picture.element.setPointerCapture(event.pointerId);
  }

  /** @param {PointerEvent} event */
  #move(event) {
    const at = this.#picture.at(event);
    if (this.#drag === null) {
      this.#name(this.#near(at));
    } else if ("radius" in this.#drag) {
      const { radius } = this.#drag;
      const [x, y] = this.#places.get(radius.about ?? "") ?? at;
      radius.value = Math.hypot(at[0] - x - 0.5, at[1] - y - 0.5);
      this.#touched();
    } else {
      const { handle, grip } = this.#drag;
      this.#put(handle, at[0] - grip[0], at[1] - grip[1]);
    }
  }

  #release() {
    this.#drag = null;
    this.#loupe.hide();
  }

  /**
   * @param {string} name
   * @param {number} x
   * @param {number} y
   */
  #put(name, x, y) {
    /** @param {number} value @param {number} most */
    const within = (value, most) => Math.min(Math.max(0, Math.round(value * 10) / 10), most);
    this.#places.set(name, [within(x, this.#picture.width - 1), within(y, this.#picture.height - 1)]);
    this.#placed.delete(name);
    this.#offered.delete(name);
    this.#magnify(name);
    this.#say(name);
    this.#touched();
  }

  /** A person has changed the mark. */
  #touched() {
    this.#isMade = true;
    this.#draw();
    this.#changed();
  }

  /** @param {string} name */
  #magnify(name) {
    const place = this.#places.get(name);
    if (place) this.#loupe.show(this.#picture, place);
  }

  /**
   * Show the name of the handle under the pointer.
   *
   * @param {string|null} name
   */
  #name(name) {
    for (const [each, handle] of this.#handles) handle.classList.toggle("near", each === name);
    this.#picture.element.classList.toggle("grip", name !== null);
  }

  /** @param {string|null} name */
  #say(name) {
    const place = name === null ? undefined : this.#places.get(name);
    const title = this.#description.handles.find((handle) => handle.name === name)?.title;
    setText(this.#words, place === undefined ? "" : `${title} at ${place.map((value) => value.toFixed(1)).join(", ")} px`);
  }

  #draw() {
    const { width, height, scale } = this.#picture;
    for (const { name, title } of this.#description.handles) {
      const handle = this.#handles.get(name);
      const place = this.#places.get(name);
      if (!handle) continue;
      handle.hidden = place === undefined;
      if (place === undefined) continue;
      handle.style.left = `${(100 * (place[0] + 0.5)) / width}%`;
      handle.style.top = `${(100 * (place[1] + 0.5)) / height}%`;
      handle.classList.toggle("placed", this.#placed.has(name));
      handle.classList.toggle("offered", this.#offered.has(name));
      handle.classList.toggle("at-right", (width - place[0]) / scale < NAME_PX);
      handle.setAttribute("aria-label", `${title}, ${Math.round(place[0])} across, ${Math.round(place[1])} down`);
    }
    for (const { ends: [from, to], drawn } of this.#lines) {
      const [a, b] = [this.#places.get(from), this.#places.get(to)];
      const at = a && b ? { x1: a[0] + 0.5, y1: a[1] + 0.5, x2: b[0] + 0.5, y2: b[1] + 0.5 } : null;
      for (const line of drawn) dress(line, at);
    }
    for (const { number, drawn } of this.#circles) {
      const centre = this.#places.get(number.about ?? "");
      const at = centre ? { cx: centre[0] + 0.5, cy: centre[1] + 0.5, r: number.value } : null;
      for (const circle of drawn) dress(circle, at);
    }
  }
}

/**
 * @param {unknown} value
 * @returns {value is Place}
 */
function isPlace(value) {
  return Array.isArray(value) && value.length === 2 && value.every(Number.isFinite);
}

/**
 * Put a line or a circle where it belongs, or out of sight.
 *
 * @param {SVGElement} shape
 * @param {Record<string, number>|null} attributes
 */
function dress(shape, attributes) {
  shape.style.display = attributes === null ? "none" : "";
  for (const [name, value] of Object.entries(attributes ?? {})) shape.setAttribute(name, String(value));
}
