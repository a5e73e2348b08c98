/**
 * One heat map on a canvas: cells that fill while they are computed, hatching where nothing was tested, a cursor for
 * mouse and keyboard. It knows neither methods nor statistics; what a cell looks like it is told.
 */

import { h } from "../shared/dom.js";
import { onTheme, tokens } from "../shared/theme.js";
import { coalesce } from "../shared/timing.js";
import { Grid, LEFT, TOP } from "./grid.js";
import { paintMap, paintRing } from "./map_paint.js";
import { clamp } from "./strokes.js";

/** @import { Axes, Cell } from "./grid.js" */
/** @import { Look } from "./map_paint.js" */
/** @import { Place } from "../shared/tooltip.js" */

/**
 * Who hears of what is pointed at and chosen.
 *
 * @typedef {object} Listener
 * @property {(cell: Cell, place: Place) => void} point
 * @property {() => void} leave Nothing is pointed at any more.
 * @property {(cell: Cell) => void} choose
 */

/** @type {Record<string, [right: number, up: number]>} */
const MOVES = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
const FAR = 5;

export class HeatMap {
  #canvas = h("canvas", { class: "map-canvas" });
  #on;
  /** @type {Axes|null} */
  #axes = null;
  /** @type {Grid|null} */
  #grid = null;
  /** @type {(index: number) => Look} */
  #look = () => ({ colour: null, filled: 0, hatched: true });
  /** @type {Cell|null} */
  #cursor = null;
  /** @type {Cell|null} */
  #chosen = null;
  #hovering = false;

  /** What is put into the page; it takes the focus. */
  element = h("div", { class: "map-plot", tabindex: 0, role: "application", "aria-roledescription": "heat map" }, this.#canvas);

  /** @param {Listener} on */
  constructor(on) {
    this.#on = on;
    const canvas = this.#canvas;
    canvas.addEventListener("pointermove", (event) => this.#hover(event));
    canvas.addEventListener("pointerleave", () => {
      this.#hovering = false;
      this.#on.leave();
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
      this.#go(this.#start);
    });
    this.element.addEventListener("blur", () => {
      if (!this.#hovering) this.#on.leave();
      this.draw();
    });
    new ResizeObserver(() => this.draw()).observe(this.element);
    onTheme(() => this.#paint());
  }

  /**
   * @param {string} label What it shows, for those who cannot see it.
   * @param {Axes} axes
   * @param {(index: number) => Look} look By the number of the cell, row after row.
   */
  show(label, axes, look) {
    this.element.setAttribute("aria-label", `${label}. Arrow keys move from cell to cell, Enter lists its runs.`);
    this.#axes = axes;
    this.#look = look;
    this.draw();
  }

  /**
   * Mark the cell whose runs are listed.
   *
   * @param {Cell|null} cell
   */
  mark(cell) {
    this.#chosen = cell;
    this.draw();
  }

  draw = coalesce(() => this.#paint());

  /** Where the cursor is when the keyboard takes over. */
  get #start() {
    return this.#cursor ?? this.#chosen ?? { i: 0, j: 0 };
  }

  #paint() {
    const width = this.element.clientWidth;
    if (this.#axes === null || width === 0) return;
    const grid = new Grid(this.#axes, width);
    this.#grid = grid;
    // Where the cells are, for whoever looks at the page from outside.
    Object.assign(this.element.dataset, { left: LEFT, top: TOP, wide: grid.wide, high: grid.high, up: grid.up });
    const scale = globalThis.devicePixelRatio || 1;
    this.#fit(grid, scale);
    const pen = /** @type {CanvasRenderingContext2D} */ (this.#canvas.getContext("2d"));
    pen.setTransform(scale, 0, 0, scale, 0, 0);
    const ink = tokens("ink", "muted", "line", "edge", "surface", "accent");
    const sheet = { pen, grid, ink };
    paintMap(sheet, this.#axes, this.#look);
    if (this.#chosen) paintRing(sheet, this.#chosen, ink.ink, 2);
    if (this.#cursor && this.element.matches(":focus-visible")) paintRing(sheet, this.#cursor, ink.accent, 3);
  }

  /**
   * Give the canvas its size.
   *
   * @param {Grid} grid
   * @param {number} scale Pixels of the canvas per px of the page.
   */
  #fit({ width, height }, scale) {
    const canvas = this.#canvas;
    const [across, down] = [Math.round(width * scale), Math.round(height * scale)];
    if (canvas.width === across && canvas.height === down) return;
    Object.assign(canvas, { width: across, height: down });
    Object.assign(canvas.style, { width: `${width}px`, height: `${height}px` });
  }

  /** @param {MouseEvent} event */
  #at(event) {
    const bounds = this.#canvas.getBoundingClientRect();
    return this.#grid?.at(event.clientX - bounds.left, event.clientY - bounds.top) ?? null;
  }

  /** @param {MouseEvent} event */
  #hover(event) {
    const cell = this.#at(event);
    this.#hovering = cell !== null;
    this.#canvas.style.cursor = cell === null ? "" : "pointer";
    if (cell === null) this.#on.leave();
    else this.#point(cell);
  }

  /** @param {Cell} cell */
  #point(cell) {
    if (this.#grid === null) return;
    const bounds = this.#canvas.getBoundingClientRect();
    const [x, y, width, height] = this.#grid.box(cell);
    this.#on.point(cell, { x: bounds.left + x + width / 2, y: bounds.top + y, below: bounds.top + y + height });
  }

  /**
   * Put the cursor on a cell.
   *
   * @param {Cell} cell
   */
  #go(cell) {
    this.#cursor = cell;
    this.#point(cell);
    this.draw();
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    if (this.#grid === null || event.ctrlKey || event.metaKey || event.altKey) return;
    const { across, up } = this.#grid;
    const now = this.#start;
    const move = MOVES[event.key];
    if (move) {
      const far = event.shiftKey ? FAR : 1;
      this.#go({ i: clamp(now.i + far * move[0], across), j: clamp(now.j + far * move[1], up) });
    } else if (event.key === "Home" || event.key === "End") {
      this.#go({ i: event.key === "Home" ? 0 : across - 1, j: now.j });
    } else if (event.key === "Enter" || event.key === " ") {
      this.#cursor = now;
      this.#on.choose(now);
      this.draw();
    } else if (event.key === "Escape") {
      this.#on.leave();
    } else {
      return;
    }
    event.preventDefault();
  }
}
