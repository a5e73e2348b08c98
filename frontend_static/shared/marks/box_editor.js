/**
 * Drawing a box on a picture: by mouse or touch (drag to draw, drag inside to move, drag a corner to resize) and by
 * keyboard (arrows move, the keys W, A, S and D resize, by 1 px or with shift by 10). The box is in pixels of the picture
 * and never leaves it.
 */

import { fill, h, setText, svg } from "../dom.js";
import { Picture, arrow } from "./picture.js";

/** @import { Description, Mark } from "./mark_json.js" */

/** @typedef {[number, number, number, number]} Box Left, top, width, height, px. */
/** @typedef {[number, number]} Place */

/** A step with shift, px. */
const FAR = 10;
/**
 * What keys do to width and height. Alt and arrows are the browser's own, back and forth between pages.
 *
 * @type {Record<string, Place>}
 */
const SIZES = { a: [-1, 0], d: [1, 0], w: [0, -1], s: [0, 1] };
const SMALLEST = 4;
/** How near to a corner a pointer takes it, and how near a finger, px of the page. */
const REACH_PX = 10;
const FINGER_PX = 24;
/** @type {Place[]} */
const CORNERS = [[0, 0], [1, 0], [0, 1], [1, 1]];

export class BoxEditor {
  /** @type {Box|null} */
  #box = null;
  /**
   * What is dragged: a new corner, the opposite one standing where it is, or the box, taken at a place within it.
   *
   * @type {{from: Place}|{grip: Place}|null}
   */
  #drag = null;
  #rectangle = svg("rect", { class: "mark-line" });
  #halo = svg("rect", { class: "mark-halo" });
  #handles = CORNERS.map(() => svg("rect", { class: "mark-corner" }));
  #picture;
  #words = h("output", { class: "picture-words", "aria-live": "polite" });
  #kind;
  #changed;

  /**
   * @param {Description} description
   * @param {string} target What is marked.
   * @param {() => void} changed Called when a person has changed the box.
   */
  constructor(description, target, changed) {
    this.#kind = description.kind;
    this.#changed = changed;
    const label = `${description.title}, ${target}. Arrow keys move it, the keys W, A, S and D resize it, with shift by 10 px`;
    const properties = { class: "mark-surface box", tabindex: 0, role: "application", "aria-label": label };
    this.#picture = new Picture(properties, [this.#halo, this.#rectangle, ...this.#handles], () => this.#draw());
    const surface = this.#picture.element;
    surface.addEventListener("pointerdown", (event) => this.#press(event));
    surface.addEventListener("pointermove", (event) => this.#move(event));
    for (const end of ["pointerup", "pointercancel"]) surface.addEventListener(end, () => (this.#drag = null));
    surface.addEventListener("keydown", (event) => this.#key(event));
    this.element = h("div", { class: "target-stage", data: { mark: description.kind } }, surface, this.#words);
    this.#draw();
  }

  get mark() {
    if (this.#box === null) return null;
    const [x, y, width, height] = this.#box;
    return { kind: this.#kind, x, y, width, height };
  }

  /** A box is drawn at once. */
  get left() {
    return 0;
  }

  /** @param {Mark|null} mark */
  set(mark) {
    this.#box = mark && [Number(mark.x), Number(mark.y), Number(mark.width), Number(mark.height)];
    this.#draw();
  }

  /** There is no box until one is drawn. */
  offer() {
    this.set(null);
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

  /** @param {PointerEvent} event */
  centre(event) {
    if (this.#box === null) return false;
    const [, , width, height] = this.#box;
    const [x, y] = this.#picture.at(event);
    this.#put(x - width / 2, y - height / 2, width, height);
    return true;
  }

  focus() {
    this.#picture.element.focus({ preventScroll: true });
  }

  /** @param {PointerEvent} event */
  #press(event) {
    if (event.button !== 0) return;
    event.preventDefault();
    this.#picture.element.setPointerCapture(event.pointerId);
    this.focus();
    const [x, y] = this.#picture.at(event);
    const corner = this.#corner(x, y, event.pointerType === "touch");
    const [left, top, width, height] = this.#box ?? [0, 0, 0, 0];
    const isInside = x > left && y > top && x < left + width && y < top + height;
    if (corner) this.#drag = { from: corner };
    else this.#drag = isInside ? { grip: [x - left, y - top] } : { from: [x, y] };
  }

  /**
   * The corner opposite to the one under the pointer.
   *
   * A finger covers it, and need not be as near; but a small box can still be moved by its middle.
   *
   * @param {number} x
   * @param {number} y
   * @param {boolean} isFinger
   * @returns {Place|null}
   */
  #corner(x, y, isFinger) {
    if (!this.#box) return null;
    const [left, top, width, height] = this.#box;
    const near = REACH_PX * this.#picture.scale;
    const reach = isFinger ? Math.max(near, Math.min(FINGER_PX * this.#picture.scale, Math.min(width, height) / 3)) : near;
    const away = (/** @type {readonly number[]} */ [i, j]) => Math.hypot(left + i * width - x, top + j * height - y);
    const hit = CORNERS.find((corner) => away(corner) <= reach);
    return hit ? [left + (1 - hit[0]) * width, top + (1 - hit[1]) * height] : null;
  }

  /** @param {PointerEvent} event */
  #move(event) {
    if (this.#drag === null) return;
    const [x, y] = this.#picture.at(event);
    if ("grip" in this.#drag) {
      if (this.#box) this.#put(x - this.#drag.grip[0], y - this.#drag.grip[1], this.#box[2], this.#box[3]);
      return;
    }
    const [fromX, fromY] = this.#drag.from;
    const [width, height] = [Math.abs(x - fromX), Math.abs(y - fromY)];
    if (width < 2 && height < 2) return;
    this.#put(Math.min(x, fromX), Math.min(y, fromY), width, height);
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    const size = this.#box && !event.ctrlKey && !event.metaKey && !event.altKey ? (SIZES[event.key.toLowerCase()] ?? null) : null;
    const direction = size ?? arrow(event);
    if (direction === null) return;
    event.preventDefault();
    event.stopPropagation();
    const [dx, dy] = direction.map((way) => way * (event.shiftKey ? FAR : 1));
    if (!this.#box) {
      const { width: across, height: down } = this.#picture;
      const side = Math.round(Math.min(across, down) / 6);
      this.#put((across - side) / 2, (down - side) / 2, side, side);
      return;
    }
    const [x, y, width, height] = this.#box;
    if (size) this.#put(x, y, width + dx, height + dy);
    else this.#put(x + dx, y + dy, width, height);
  }

  /**
   * @param {number} x
   * @param {number} y
   * @param {number} width
   * @param {number} height
   */
  #put(x, y, width, height) {
    const { width: across, height: down } = this.#picture;
    const w = Math.min(Math.max(SMALLEST, Math.round(width)), across);
    const t = Math.min(Math.max(SMALLEST, Math.round(height)), down);
    this.#box = [Math.min(Math.max(0, Math.round(x)), across - w), Math.min(Math.max(0, Math.round(y)), down - t), w, t];
    this.#draw();
    this.#changed();
  }

  #draw() {
    const shown = this.#box !== null;
    const [x, y, width, height] = this.#box ?? [0, 0, 0, 0];
    for (const element of [this.#rectangle, this.#halo, ...this.#handles]) element.style.display = shown ? "" : "none";
    if (!shown) {
      fill(this.#words, h("span", { class: "by-keyboard" }, "By keyboard, arrows make and move the box, and W, A, S, D resize it; shift goes by 10 px."));
      return;
    }
    setText(this.#words, `${width} × ${height} px at ${x}, ${y}`);
    for (const element of [this.#rectangle, this.#halo]) place(element, { x, y, width, height });
    const side = 8 * this.#picture.scale;
    this.#handles.forEach((handle, index) => {
      const [i, j] = CORNERS[index];
      place(handle, { x: x + i * width - side / 2, y: y + j * height - side / 2, width: side, height: side });
    });
  }
}

/**
 * @param {Element} element
 * @param {Record<string, number>} attributes
 */
function place(element, attributes) {
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, String(value));
}
