/**
 * One heat map on a canvas: cells that fill while they are computed, hatching where nothing was tested, a cursor for
 * mouse and keyboard. It knows neither methods nor statistics; what a cell looks like it is told.
 */

import { h } from "../shared/dom.js";
import { coalesce } from "../shared/timing.js";
import { css, inkOn } from "./colours.js";
import { clamp, hatch, short, sparse, titled } from "./strokes.js";
import { onTheme, tokens } from "../shared/theme.js";

const LEFT = 46;
const RIGHT = 10;
const TOP = 8;
const BOTTOM = 44;
const SMALLEST_TEXT_PX = 30;
const LARGEST_CELL_PX = 72;
const LONGEST_HEIGHT_PX = 400;
const FONT = '12px system-ui, -apple-system, "Segoe UI", Roboto, "Liberation Sans", sans-serif';

/**
 * @typedef {import("../shared/messages.js").AxisPublic} AxisPublic
 * @typedef {{i: number, j: number}} Cell
 *
 * @typedef {object} Look What a cell looks like.
 * @property {Readonly<import("./colours.js").Colour>|null} colour Red, green, blue; null where there is no value yet.
 * @property {string} [text] Written into the cell if there is room.
 * @property {number} filled Share of the cell that is coloured, 0..1.
 * @property {boolean} [outlined] With a line around it, for colours near that of the page.
 * @property {boolean} hatched Not tested, and not going to be.
 */

export class HeatMap {
  #canvas = h("canvas", { class: "map-canvas" });
  #on;
  /** @type {{x: AxisPublic, y: AxisPublic|null}|null} */
  #axes = null;
  /** @type {(index: number) => Look} */
  #look = () => ({ colour: null, filled: 0, hatched: true });
  /** @type {Cell|null} */
  #cursor = null;
  /** @type {Cell|null} */
  #chosen = null;
  #size = { width: 0, height: 0, cell: [1, 1] };
  #hovering = false;

  /** What is put into the page; it takes the focus. */
  element = h("div", { class: "map-plot", tabindex: 0, role: "application", "aria-roledescription": "heat map" }, this.#canvas);

  /** @param {{point: (cell: Cell|null, place?: {x: number, y: number, below: number}) => void, choose: (cell: Cell) => void}} on */
  constructor(on) {
    this.#on = on;
    const canvas = this.#canvas;
    canvas.addEventListener("pointermove", (event) => this.#hover(event));
    canvas.addEventListener("pointerleave", () => {
      this.#hovering = false;
      this.#on.point(null);
    });
    canvas.addEventListener("click", (event) => {
      const cell = this.#at(event);
      if (cell === null) return;
      this.#cursor = cell;
      this.#on.choose(cell);
    });
    this.element.addEventListener("keydown", (event) => this.#key(event));
    this.element.addEventListener("focus", () => {
      if (!this.element.matches(":focus-visible")) return;
      this.#cursor ??= this.#chosen ?? { i: 0, j: 0 };
      this.#tellCursor();
    });
    this.element.addEventListener("blur", () => {
      if (!this.#hovering) this.#on.point(null);
      this.draw();
    });
    new ResizeObserver(() => this.draw()).observe(this.element);
    onTheme(() => this.draw());
  }

  /**
   * @param {string} label What it shows, for those who cannot see it.
   * @param {{x: AxisPublic, y: AxisPublic|null}} axes With `name`, `title`, `unit`, `values`.
   * @param {(index: number) => Look} look By the number of the cell, row after row.
   */
  show(label, axes, look) {
    this.element.setAttribute("aria-label", `${label}. Arrow keys move from cell to cell, Enter lists its runs.`);
    this.#axes = axes;
    this.#look = look;
    this.draw();
  }

  /** Mark the cell whose runs are listed. */
  mark(cell) {
    this.#chosen = cell;
    this.draw();
  }

  draw = coalesce(() => this.#paint());

  get #count() {
    return [this.#axes?.x.values.length ?? 0, this.#axes?.y?.values.length ?? 1];
  }

  #paint() {
    if (this.#axes === null) return;
    const width = this.element.clientWidth;
    if (width === 0) return;
    const [across, up] = this.#count;
    const wide = Math.min((width - LEFT - RIGHT) / across, LARGEST_CELL_PX);
    const high = Math.min(wide, (LONGEST_HEIGHT_PX - TOP - BOTTOM) / up);
    this.#size = { width, height: Math.round(high * up + TOP + BOTTOM), cell: [wide, Math.max(high, 3)] };
    // Where the cells are, for whoever looks at the page from outside.
    Object.assign(this.element.dataset, { left: LEFT, top: TOP, wide, high: this.#size.cell[1], up });
    const scale = globalThis.devicePixelRatio || 1;
    const canvas = this.#canvas;
    const [w, t] = [Math.round(width * scale), Math.round(this.#size.height * scale)];
    if (canvas.width !== w || canvas.height !== t) {
      Object.assign(canvas, { width: w, height: t });
      Object.assign(canvas.style, { width: `${width}px`, height: `${this.#size.height}px` });
    }
    const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    pen.setTransform(scale, 0, 0, scale, 0, 0);
    pen.clearRect(0, 0, width, this.#size.height);
    pen.font = FONT;
    const ink = tokens("ink", "muted", "line", "edge", "surface", "accent");
    for (let j = 0; j < up; j += 1) for (let i = 0; i < across; i += 1) this.#cell(pen, ink, i, j);
    this.#scales(pen, ink);
    if (this.#chosen) this.#ring(pen, this.#chosen, ink.ink, ink.surface, 2);
    if (this.#cursor && this.element.matches(":focus-visible")) this.#ring(pen, this.#cursor, ink.accent, ink.surface, 3);
  }

  /** Corner and extent of a cell; the values of the y axis grow upwards. */
  #box(i, j) {
    const [wide, high] = this.#size.cell;
    const up = this.#count[1];
    const [x0, x1] = [Math.round(LEFT + i * wide), Math.round(LEFT + (i + 1) * wide)];
    const [y0, y1] = [Math.round(TOP + (up - 1 - j) * high), Math.round(TOP + (up - j) * high)];
    return [x0, y0, x1 - x0, y1 - y0];
  }

  #cell(pen, ink, i, j) {
    const [x, y, width, height] = this.#box(i, j);
    const gap = Math.min(width, height) > 8 ? 1 : 0;
    const [left, top, w, t] = [x, y, width - gap, height - gap];
    const look = this.#look(j * this.#count[0] + i);
    if (look.hatched) {
      hatch(pen, left, top, w, t, ink.line);
      return;
    }
    if (look.filled < 1) {
      pen.strokeStyle = ink.line;
      pen.lineWidth = 1;
      pen.strokeRect(left + 0.5, top + 0.5, w - 1, t - 1);
    }
    if (look.filled === 0) return;
    if (look.colour === null) {
      // Computed, but without a value: no run succeeded, say.
      pen.strokeStyle = ink.line;
      pen.lineWidth = 1;
      pen.strokeRect(left + 0.5, top + 0.5, w - 1, t - 1);
      if (look.filled === 1) this.#write(pen, "–", ink.muted, left, top, w, t);
      return;
    }
    // An area that grows with the runs that are done; from the first on it can be seen.
    const side = Math.max(Math.sqrt(look.filled), 0.25);
    const [inner, tall] = [w * side, t * side];
    pen.fillStyle = css(look.colour);
    pen.fillRect(left + (w - inner) / 2, top + (t - tall) / 2, inner, tall);
    if (look.outlined) {
      pen.strokeStyle = ink.line;
      pen.lineWidth = 1;
      pen.strokeRect(left + 0.5, top + 0.5, w - 1, t - 1);
    }
    if (look.text && look.filled === 1) this.#write(pen, look.text, inkOn(look.colour), left, top, w, t);
  }

  /** Write into a cell, if there is room. */
  #write(pen, text, colour, left, top, width, height) {
    if (width < SMALLEST_TEXT_PX || height < SMALLEST_TEXT_PX / 2) return;
    pen.fillStyle = colour;
    pen.font = FONT.replace("12px", `${Math.round(Math.min(17, Math.max(11, 0.3 * Math.min(width, height))))}px`);
    pen.textAlign = "center";
    pen.textBaseline = "middle";
    pen.fillText(text, left + width / 2, top + height / 2 + 0.5);
  }

  #scales(pen, ink) {
    if (this.#axes === null) return;
    const { x, y } = this.#axes;
    const [wide, high] = this.#size.cell;
    const [across, up] = this.#count;
    pen.font = FONT;
    pen.fillStyle = ink.muted;
    pen.textBaseline = "top";
    pen.textAlign = "center";
    const widest = Math.max(...x.values.map((value) => pen.measureText(short(value)).width)) + 6;
    for (const i of sparse(across, Math.max(1, Math.ceil(widest / wide)))) {
      pen.fillText(short(x.values[i]), LEFT + (i + 0.5) * wide, TOP + up * high + 5);
    }
    pen.fillStyle = ink.ink;
    pen.fillText(titled(x), LEFT + (across * wide) / 2, TOP + up * high + 23, Math.max(across * wide, this.#size.width - LEFT));
    if (y === null) return;
    pen.fillStyle = ink.muted;
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    for (const j of sparse(up, Math.max(1, Math.ceil(14 / high)))) {
      pen.fillText(short(y.values[j]), LEFT - 6, TOP + (up - j - 0.5) * high, LEFT - 22);
    }
    pen.save();
    pen.translate(8, TOP + (up * high) / 2);
    pen.rotate(-Math.PI / 2);
    pen.textAlign = "center";
    pen.fillStyle = ink.ink;
    pen.fillText(titled(y), 0, 0, Math.max(up * high + TOP + 20, 90));
    pen.restore();
  }

  #ring(pen, { i, j }, colour, ground, width) {
    const [x, y, w, t] = this.#box(i, j);
    pen.lineWidth = width + 2;
    pen.strokeStyle = ground;
    pen.strokeRect(x - 1, y - 1, w + 1, t + 1);
    pen.lineWidth = width;
    pen.strokeStyle = colour;
    pen.strokeRect(x - 1, y - 1, w + 1, t + 1);
  }

  // ---------------------------------------------------------------- pointing

  #at(event) {
    if (this.#axes === null) return null;
    const [wide, high] = this.#size.cell;
    const [across, up] = this.#count;
    const bounds = this.#canvas.getBoundingClientRect();
    const i = Math.floor((event.clientX - bounds.left - LEFT) / wide);
    const j = up - 1 - Math.floor((event.clientY - bounds.top - TOP) / high);
    return i >= 0 && i < across && j >= 0 && j < up ? { i, j } : null;
  }

  #hover(event) {
    const cell = this.#at(event);
    this.#hovering = cell !== null;
    this.#canvas.style.cursor = cell === null ? "" : "pointer";
    this.#on.point(cell, cell === null ? undefined : this.#place(cell));
  }

  /** Where a cell is in the window: the middle of its upper edge. */
  #place({ i, j }) {
    const bounds = this.#canvas.getBoundingClientRect();
    const [x, y, width, height] = this.#box(i, j);
    return { x: bounds.left + x + width / 2, y: bounds.top + y, below: bounds.top + y + height };
  }

  #tellCursor() {
    if (this.#cursor) this.#on.point(this.#cursor, this.#place(this.#cursor));
    this.draw();
  }

  #key(event) {
    if (this.#axes === null || event.ctrlKey || event.metaKey || event.altKey) return;
    const [across, up] = this.#count;
    const now = this.#cursor ?? this.#chosen ?? { i: 0, j: 0 };
    const far = event.shiftKey ? 5 : 1;
    const moves = { ArrowLeft: [-far, 0], ArrowRight: [far, 0], ArrowUp: [0, far], ArrowDown: [0, -far] };
    if (event.key in moves) {
      const [di, dj] = moves[event.key];
      this.#cursor = { i: clamp(now.i + di, across), j: clamp(now.j + dj, up) };
      this.#tellCursor();
    } else if (event.key === "Home" || event.key === "End") {
      this.#cursor = { i: event.key === "Home" ? 0 : across - 1, j: now.j };
      this.#tellCursor();
    } else if (event.key === "Enter" || event.key === " ") {
      this.#cursor = now;
      this.#on.choose(now);
      this.draw();
    } else if (event.key === "Escape") {
      this.#on.point(null);
    } else {
      return;
    }
    event.preventDefault();
  }
}
