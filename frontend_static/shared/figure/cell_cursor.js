/** Choosing a cell of a map by pointer or keys: a ring around the cell at the cursor, and one around the chosen cell. */

import { h } from "../dom.js";
import { cellsOf } from "./cells.js";

/** @import { Sheet } from "./canvas.js" */
/** @import { Cell, CellMap } from "./traces.js" */

/**
 * @typedef {object} Listener
 * @property {(cell: Cell|null) => void} point The keys have come to a cell, or left all.
 * @property {(cell: Cell) => void} choose
 */

/** @type {Record<string, [right: number, up: number]>} */
const MOVES = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
const FAR = 5;

export class CellCursor {
  #place;
  #on;
  #chosen = h("span", { class: "figure-ring", hidden: true });
  #ring = h("span", { class: "figure-ring cursor", hidden: true });
  /** @type {Sheet|null} */
  #sheet = null;
  /** @type {CellMap|null} */
  #map = null;
  /** @type {Cell|null} */
  #at = null;

  /** The rings, which lie over the map. */
  element = h("div", { class: "figure-rings", "aria-hidden": "true" }, this.#chosen, this.#ring);

  /**
   * @param {HTMLElement} place What has the map in it; it takes the focus.
   * @param {Listener} on
   */
  constructor(place, on) {
    this.#place = place;
    this.#on = on;
    place.addEventListener("keydown", (event) => this.#key(event));
    place.addEventListener("focus", () => {
      if (this.#map !== null && place.matches(":focus-visible")) this.#go(this.#start);
    });
    place.addEventListener("blur", () => {
      if (this.#map === null) return;
      this.#on.point(null);
      this.#draw();
    });
  }

  /**
   * @param {Sheet} sheet
   * @param {CellMap|null} map Null where there are no cells to choose.
   */
  show(sheet, map) {
    this.#sheet = sheet;
    if ((map === null) !== (this.#map === null)) this.#dress(map !== null);
    this.#map = map;
    this.#draw();
  }

  /**
   * A cell was chosen by the pointer: the keys go on from there.
   *
   * @param {Cell} cell
   */
  choose(cell) {
    this.#at = cell;
    this.#on.choose(cell);
    this.#draw();
  }

  /** Where the cursor is when the keys take over. */
  get #start() {
    return this.#at ?? this.#map?.chosen ?? { i: 0, j: 0 };
  }

  /** @param {boolean} isMap Whether there are cells to choose; else it is a picture like any. */
  #dress(isMap) {
    this.#place.setAttribute("role", isMap ? "application" : "img");
    this.#place.toggleAttribute("aria-roledescription", false);
    this.#place.removeAttribute("tabindex");
    if (!isMap) return;
    this.#place.setAttribute("aria-roledescription", "heat map");
    this.#place.tabIndex = 0;
  }

  #draw() {
    const isFocused = this.#place.matches(":focus-visible");
    this.#surround(this.#chosen, this.#map?.chosen ?? null);
    this.#surround(this.#ring, isFocused ? this.#at : null);
  }

  /**
   * @param {HTMLElement} ring
   * @param {Cell|null} cell
   */
  #surround(ring, cell) {
    const { across = 0, up = 0 } = this.#map ?? {};
    const isThere = cell !== null && cell.i < across && cell.j < up;
    ring.hidden = !isThere;
    if (!isThere || this.#map === null || this.#sheet === null) return;
    const box = cellsOf(this.#sheet, this.#map).box(cell);
    for (const [side, px] of Object.entries(box)) ring.style.setProperty(side, `${px}px`);
  }

  /**
   * Put the cursor on a cell.
   *
   * @param {Cell} cell
   */
  #go(cell) {
    this.#at = cell;
    this.#on.point(cell);
    this.#draw();
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    if (this.#map === null || event.ctrlKey || event.metaKey || event.altKey) return;
    const { across, up } = this.#map;
    const now = this.#start;
    const move = MOVES[event.key];
    if (move) {
      const far = event.shiftKey ? FAR : 1;
      this.#go({ i: clamp(now.i + far * move[0], across), j: clamp(now.j + far * move[1], up) });
    } else if (event.key === "Home" || event.key === "End") {
      this.#go({ i: event.key === "Home" ? 0 : across - 1, j: now.j });
    } else if (event.key === "Enter" || event.key === " ") {
      this.choose(now);
    } else if (event.key === "Escape") {
      this.#on.point(null);
    } else {
      return;
    }
    event.preventDefault();
  }
}

/**
 * The nearest of the numbers 0..count-1.
 *
 * @param {number} value
 * @param {number} count
 */
function clamp(value, count) {
  return Math.min(Math.max(value, 0), count - 1);
}
