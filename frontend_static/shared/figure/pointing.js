/**
 * What a panel says of the place that is pointed at, by pointer or, where there are cells, by keys; and choosing a cell, with
 * a ring around the one at the cursor, and one around the chosen one.
 */

import { h } from "../dom.js";
import { coalesce } from "../timing.js";
import { KINDS } from "./kinds.js";
import { cellsOf, isCellMap } from "./maps.js";
import { REACH } from "./paint.js";

/** @import { Hit, Sheet } from "./paint.js" */
/** @import { Shared } from "./panel.js" */
/** @import { Cell, Panel } from "./traces.js" */

/** @type {Record<string, [right: number, up: number]>} */
const MOVES = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
const FAR = 5;

export class Pointing {
  #plot;
  #picture;
  #shared;
  #spot = h("span", { class: "figure-spot", hidden: true });
  #chosen = h("span", { class: "figure-ring", hidden: true });
  #ring = h("span", { class: "figure-ring cursor", hidden: true });
  /** @type {{panel: Panel, sheet: Sheet}|null} */
  #drawn = null;
  /** @type {PointerEvent|null} */
  #pointer = null;
  /** The cell that the keys have come to.
   *
   * @type {Cell|null} */
  #at = null;
  #soon;

  /** What lies over the panel. */
  elements = [h("div", { class: "figure-rings", "aria-hidden": "true" }, this.#chosen, this.#ring), this.#spot];

  /**
   * @param {HTMLElement} plot
   * @param {HTMLElement} picture Within it; what is put over it has its own way with a pointer.
   * @param {Shared} shared
   */
  constructor(plot, picture, shared) {
    this.#plot = plot;
    this.#picture = picture;
    this.#shared = shared;
    this.#soon = coalesce(() => this.#point(), shared.signal);
    for (const type of /** @type {const} */ (["pointermove", "pointerdown", "pointerleave"])) {
      plot.addEventListener(type, (event) => {
        this.#pointer = type === "pointerleave" ? null : event;
        this.#soon();
      });
    }
    picture.addEventListener("click", (event) => {
      const cell = this.#hit(event)?.cell;
      if (cell === undefined) return;
      shared.tip.hide();
      this.#choose(cell);
    });
    picture.addEventListener("keydown", (event) => this.#key(event));
    picture.addEventListener("focus", () => {
      if (this.#map !== null && picture.matches(":focus-visible")) this.#go(this.#start);
    });
    picture.addEventListener("blur", () => {
      if (this.#map !== null && this.#pointer === null) this.#tell(null);
      this.#surround();
    });
  }

  /** The map whose cells can be chosen, if there is one. */
  get #map() {
    return this.#drawn?.panel.traces.find(isCellMap) ?? null;
  }

  /** Where the cursor is when the keys take over. */
  get #start() {
    return this.#at ?? this.#map?.chosen ?? { i: 0, j: 0 };
  }

  /**
   * Take over what is drawn now.
   *
   * @param {Panel} panel
   * @param {Sheet} sheet
   */
  show(panel, sheet) {
    const had = this.#map !== null;
    this.#drawn = { panel, sheet };
    const has = this.#map !== null;
    if (has !== had) {
      // Without cells to choose it is a picture like any.
      this.#picture.setAttribute("role", has ? "application" : "img");
      for (const [name, value] of Object.entries({ "aria-roledescription": "heat map", tabindex: "0" })) {
        if (has) this.#picture.setAttribute(name, value);
        else this.#picture.removeAttribute(name);
      }
    }
    this.#surround();
    // What is pointed at may have moved away.
    if (this.#pointer !== null) this.#soon();
  }

  /** Say what the pointer is at, unless it is about to move something. */
  #point() {
    const hit = this.#pointer && this.#hit(this.#pointer);
    this.#spot.hidden = !hit || hit.cell !== undefined;
    this.#picture.classList.toggle("choosing", Boolean(hit?.cell));
    if (!hit?.words) {
      this.#tell(hit?.cell ?? null);
      return;
    }
    const { left, top } = this.#plot.getBoundingClientRect();
    Object.assign(this.#spot.style, { left: `${hit.x}px`, top: `${hit.y}px` });
    this.#shared.tip.show(hit.words, { x: left + hit.x, y: top + hit.y, below: top + hit.y });
  }

  /**
   * Say what is known of a cell, above it.
   *
   * @param {Cell|null} cell Null for nothing.
   */
  #tell(cell) {
    const { tip, on } = this.#shared;
    const words = cell && on.describe?.(this.#drawn?.panel.id ?? "", cell);
    if (this.#drawn === null || this.#map === null || cell === null || words === undefined) {
      tip.hide();
      return;
    }
    const around = this.#plot.getBoundingClientRect();
    const { left, top, width, height } = cellsOf(this.#drawn.sheet, this.#map).box(cell);
    tip.show(words, { x: around.left + left + width / 2, y: around.top + top, below: around.top + top + height });
  }

  /**
   * The nearest thing within reach of a pointer that is in the picture; of equals the one in front.
   *
   * @param {MouseEvent} event
   */
  #hit({ clientX, clientY, target }) {
    if (this.#drawn === null || !(target instanceof Node) || !this.#picture.contains(target)) return null;
    const { panel, sheet } = this.#drawn;
    const around = this.#plot.getBoundingClientRect();
    const [px, py] = [clientX - around.left, clientY - around.top];
    const { left, top, width, height } = sheet.box;
    if (px < left || px > left + width || py < top || py > top + height) return null;
    /** @type {Hit|null} */
    let nearest = null;
    for (const trace of panel.traces) {
      const hit = KINDS[trace.kind].near?.(sheet, trace, px, py, panel.traces) ?? null;
      if (hit !== null && hit.distance <= Math.min(REACH * sheet.unit, nearest?.distance ?? Infinity)) nearest = hit;
    }
    return nearest;
  }

  #surround() {
    const cursor = this.#picture.matches(":focus-visible") ? this.#at : null;
    for (const [ring, cell] of /** @type {const} */ ([[this.#chosen, this.#map?.chosen ?? null], [this.#ring, cursor]])) {
      const map = this.#map;
      ring.hidden = map === null || cell === null || cell.i >= map.across || cell.j >= map.up;
      if (ring.hidden || this.#drawn === null || map === null || cell === null) continue;
      for (const [side, px] of Object.entries(cellsOf(this.#drawn.sheet, map).box(cell))) ring.style.setProperty(side, `${px}px`);
    }
  }

  /**
   * Put the cursor of the keys on a cell.
   *
   * @param {Cell} cell
   */
  #go(cell) {
    this.#pointer = null;
    this.#at = cell;
    this.#tell(cell);
    this.#surround();
  }

  /** @param {Cell} cell */
  #choose(cell) {
    // The keys go on from there.
    this.#at = cell;
    this.#shared.on.choose?.(this.#drawn?.panel.id ?? "", cell);
    this.#surround();
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    const map = this.#map;
    if (map === null || event.ctrlKey || event.metaKey || event.altKey) return;
    const now = this.#start;
    const [right, up] = MOVES[event.key] ?? [0, 0];
    const far = event.shiftKey ? FAR : 1;
    if (right || up) this.#go({ i: clamp(now.i + far * right, map.across), j: clamp(now.j + far * up, map.up) });
    else if (event.key === "Home" || event.key === "End") this.#go({ i: event.key === "Home" ? 0 : map.across - 1, j: now.j });
    else if (event.key === "Enter" || event.key === " ") this.#choose(now);
    else if (event.key === "Escape") this.#tell(null);
    else return;
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
