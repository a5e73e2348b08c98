/**
 * Drawing a box on a picture: by mouse or touch (drag to draw, drag inside to move, drag a corner to resize) and by
 * keyboard (arrows move, shift+arrows resize). The box is in pixels of the picture and never leaves it.
 */

import { fill, h, setText, svg } from "../../shared/dom.js";
import { Picture, arrow } from "./picture.js";

const SMALLEST = 4;
const CORNERS = [[0, 0], [1, 0], [0, 1], [1, 1]];

export class BoxEditor {
  #box = null;
  #drag = null;
  #rectangle = svg("rect", { class: "box-line" });
  #halo = svg("rect", { class: "box-halo" });
  #handles = CORNERS.map(() => svg("rect", { class: "box-handle" }));
  #picture = new Picture(
    {
      class: "box-surface",
      tabindex: 0,
      role: "application",
      "aria-label": "Box of the target. Arrow keys move it, shift and arrow keys resize it",
    },
    [this.#halo, this.#rectangle, ...this.#handles],
    () => this.#draw(),
  );
  #words = h("output", { class: "picture-words", "aria-live": "polite" });
  #changed;

  /**
   * @param {HTMLElement} root
   * @param {(box: number[]|null) => void} changed
   */
  constructor(root, changed) {
    this.#changed = changed;
    const surface = this.#picture.element;
    fill(root, surface, this.#words);
    surface.addEventListener("pointerdown", (event) => this.#press(event));
    surface.addEventListener("pointermove", (event) => this.#move(event));
    for (const end of ["pointerup", "pointercancel"]) surface.addEventListener(end, () => this.#release());
    surface.addEventListener("keydown", (event) => this.#key(event));
    this.#draw();
  }

  /** [x, y, width, height] in px of the picture, or null before one was drawn. */
  get box() {
    return this.#box;
  }

  /** The box as a mark, or null. */
  get mark() {
    if (this.#box === null) return null;
    const [x, y, width, height] = this.#box;
    return { kind: "box", x, y, width, height };
  }

  set box(box) {
    this.#box = box;
    this.#draw();
    this.#changed(box);
  }

  /** Show a picture of this size. */
  show(address, width, height) {
    this.#picture.show(address, width, height);
    this.#draw();
  }

  focus() {
    this.#picture.element.focus({ preventScroll: true });
  }

  #press(event) {
    if (event.button !== 0) return;
    event.preventDefault();
    this.#picture.element.setPointerCapture(event.pointerId);
    this.focus();
    const [x, y] = this.#picture.at(event);
    const corner = this.#corner(x, y);
    if (corner) {
      this.#drag = { from: corner };
    } else if (this.#box && x > this.#box[0] && y > this.#box[1] && x < this.#box[0] + this.#box[2] && y < this.#box[1] + this.#box[3]) {
      this.#drag = { grip: [x - this.#box[0], y - this.#box[1]] };
    } else {
      this.#drag = { from: [x, y] };
    }
  }

  /** The corner opposite to the one under the pointer. */
  #corner(x, y) {
    if (!this.#box) return null;
    const reach = 10 * this.#picture.scale;
    const [left, top, width, height] = this.#box;
    const hit = CORNERS.find(([i, j]) => Math.hypot(left + i * width - x, top + j * height - y) <= reach);
    return hit ? [left + (1 - hit[0]) * width, top + (1 - hit[1]) * height] : null;
  }

  #move(event) {
    if (this.#drag === null) return;
    const [x, y] = this.#picture.at(event);
    if (this.#drag.grip) {
      this.#set(x - this.#drag.grip[0], y - this.#drag.grip[1], this.#box[2], this.#box[3]);
      return;
    }
    const [fromX, fromY] = this.#drag.from;
    const [width, height] = [Math.abs(x - fromX), Math.abs(y - fromY)];
    if (width < 2 && height < 2) return;
    this.#set(Math.min(x, fromX), Math.min(y, fromY), width, height);
  }

  #release() {
    this.#drag = null;
  }

  #key(event) {
    const direction = arrow(event);
    if (direction === null) return;
    event.preventDefault();
    event.stopPropagation();
    const [dx, dy] = direction;
    if (!this.#box) {
      const { width: across, height: down } = this.#picture;
      const side = Math.round(Math.min(across, down) / 6);
      this.#set((across - side) / 2, (down - side) / 2, side, side);
      return;
    }
    const [x, y, width, height] = this.#box;
    if (event.shiftKey) this.#set(x, y, width + dx, height + dy);
    else this.#set(x + dx, y + dy, width, height);
  }

  #set(x, y, width, height) {
    const { width: across, height: down } = this.#picture;
    const w = Math.min(Math.max(SMALLEST, Math.round(width)), across);
    const hgt = Math.min(Math.max(SMALLEST, Math.round(height)), down);
    this.box = [
      Math.min(Math.max(0, Math.round(x)), across - w),
      Math.min(Math.max(0, Math.round(y)), down - hgt),
      w,
      hgt,
    ];
  }

  #draw() {
    const shown = this.#box !== null;
    for (const element of [this.#rectangle, this.#halo, ...this.#handles]) element.style.display = shown ? "" : "none";
    setText(
      this.#words,
      shown
        ? `${this.#box[2]} × ${this.#box[3]} px at ${this.#box[0]}, ${this.#box[1]}`
        : "Drag a box around the target. By keyboard, arrows move the box and shift+arrows resize it.",
    );
    if (!shown) return;
    const [x, y, width, height] = this.#box;
    for (const element of [this.#rectangle, this.#halo]) place(element, x, y, width, height);
    const side = 8 * this.#picture.scale;
    this.#handles.forEach((handle, index) => {
      const [i, j] = CORNERS[index];
      place(handle, x + i * width - side / 2, y + j * height - side / 2, side, side);
    });
  }
}

function place(element, x, y, width, height) {
  element.setAttribute("x", x);
  element.setAttribute("y", y);
  element.setAttribute("width", width);
  element.setAttribute("height", height);
}
