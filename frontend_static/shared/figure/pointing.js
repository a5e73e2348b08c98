/** What a panel says of the place that is pointed at, by pointer or, where there are cells, by keys. */

import { h } from "../dom.js";
import { coalesce } from "../timing.js";
import { CellCursor } from "./cell_cursor.js";
import { cellsOf, isCellMap } from "./cells.js";
import { counted, kindOf } from "./kinds/kinds.js";
import { REACH } from "./canvas.js";

/** @import { Box } from "./box.js" */
/** @import { Shared } from "./panel.js" */
/** @import { Hit, Sheet } from "./canvas.js" */
/** @import { Cell, Panel } from "./traces.js" */

export class Pointing {
  #plot;
  #picture;
  #shared;
  #spot = h("span", { class: "figure-spot", hidden: true });
  #cursor;
  /** @type {Panel|null} */
  #panel = null;
  /** @type {Sheet|null} */
  #sheet = null;
  /** @type {PointerEvent|null} */
  #pointer = null;
  #soon;

  /** What lies over the panel. */
  elements;

  /**
   * @param {HTMLElement} plot
   * @param {HTMLElement} picture Within it; what is put over it has its own way with a pointer.
   * @param {Shared} shared
   */
  constructor(plot, picture, shared) {
    this.#plot = plot;
    this.#picture = picture;
    this.#shared = shared;
    this.#cursor = new CellCursor(picture, { point: (cell) => this.#visit(cell), choose: (cell) => shared.on.choose?.(this.#panel?.id ?? "", cell) });
    this.elements = [this.#cursor.element, this.#spot];
    this.#soon = coalesce(() => this.#point(), shared.signal);
    for (const type of /** @type {const} */ (["pointermove", "pointerdown"])) {
      plot.addEventListener(type, (event) => {
        this.#pointer = event;
        this.#soon();
      });
    }
    plot.addEventListener("pointerleave", () => {
      this.#pointer = null;
      this.#soon();
    });
    picture.addEventListener("click", (event) => {
      const cell = this.#at(event)?.cell;
      if (cell === undefined) return;
      shared.tip.hide();
      this.#cursor.choose(cell);
    });
  }

  /**
   * Take over what is drawn now.
   *
   * @param {Panel} panel
   * @param {Sheet} sheet
   */
  show(panel, sheet) {
    this.#panel = panel;
    this.#sheet = sheet;
    this.#cursor.show(sheet, panel.traces.find(isCellMap) ?? null);
    // What is pointed at may have moved away.
    if (this.#pointer !== null) this.#soon();
  }

  /** Say what the pointer is at, unless it is about to move something. */
  #point() {
    const hit = this.#pointer && this.#at(this.#pointer);
    this.#spot.hidden = !hit || hit.cell !== undefined;
    this.#picture.classList.toggle("choosing", Boolean(hit?.cell));
    if (!hit) {
      this.#shared.tip.hide();
      return;
    }
    if (hit.cell && hit.box) {
      this.#tell(hit.cell, hit.box);
      return;
    }
    const around = this.#plot.getBoundingClientRect();
    Object.assign(this.#spot.style, { left: `${hit.x}px`, top: `${hit.y}px` });
    this.#shared.tip.show(hit.words, { x: around.left + hit.x, y: around.top + hit.y, below: around.top + hit.y });
  }

  /**
   * The keys have come to a cell.
   *
   * @param {Cell|null} cell Null if they have left.
   */
  #visit(cell) {
    if (cell === null) {
      if (this.#pointer === null) this.#shared.tip.hide();
      return;
    }
    this.#pointer = null;
    const map = this.#panel?.traces.find(isCellMap);
    if (this.#sheet !== null && map !== undefined) this.#tell(cell, cellsOf(this.#sheet, map).box(cell));
  }

  /**
   * Say what is known of a cell, above it.
   *
   * @param {Cell} cell
   * @param {Box} box
   */
  #tell(cell, { left, top, width, height }) {
    const words = this.#shared.on.describe?.(this.#panel?.id ?? "", cell);
    if (words === undefined) return;
    const around = this.#plot.getBoundingClientRect();
    const [x, y] = [around.left + left + width / 2, around.top + top];
    this.#shared.tip.show(words, { x, y, below: y + height });
  }

  /**
   * What a pointer is at in the picture, if at anything.
   *
   * @param {MouseEvent} event
   */
  #at({ clientX, clientY, target }) {
    if (!(target instanceof Node) || !this.#picture.contains(target)) return null;
    const { left, top } = this.#plot.getBoundingClientRect();
    return this.#nearest(clientX - left, clientY - top);
  }

  /**
   * The nearest thing within reach; of equals the one in front.
   *
   * @param {number} px
   * @param {number} py
   */
  #nearest(px, py) {
    if (this.#panel === null || this.#sheet === null) return null;
    const sheet = this.#sheet;
    const { left, top, width, height } = sheet.box;
    if (px < left || px > left + width || py < top || py > top + height) return null;
    /** @type {Hit|null} */
    let nearest = null;
    for (const { trace, among } of counted(this.#panel.traces)) {
      const hit = kindOf(trace).near(sheet, trace, px, py, among);
      if (hit !== null && hit.distance <= Math.min(REACH * sheet.unit, nearest?.distance ?? Infinity)) nearest = hit;
    }
    return nearest;
  }
}
