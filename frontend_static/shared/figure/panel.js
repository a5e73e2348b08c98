/** One panel on the page: its title and key, its axes and traces, its handles, and what is asked and marked in it. */

import { h, setText } from "../dom.js";
import { PlaceQuestion } from "./place_question.js";
import { Axes } from "./axes.js";
import { GAP, boxOf, furniture, margins, scales } from "./box.js";
import { isCellMap } from "./cells.js";
import { Handle, boundsOf } from "./handle.js";
import { Legend } from "./legend.js";
import { OVER, counted, kindOf } from "./kinds/kinds.js";
import { markLines, wordsOf } from "./marks.js";
import { Pointing } from "./pointing.js";
import { within } from "./canvas.js";
import { describe } from "./description.js";

/** @import { Tooltip } from "../tooltip.js" */
/** @import { Furniture, Margins } from "./box.js" */
/** @import { Mark } from "./marks.js" */
/** @import { Sheet } from "./canvas.js" */
/** @import { Panel } from "./traces.js" */

/**
 * What a figure's panels share.
 *
 * @typedef {object} Shared
 * @property {Tooltip} tip
 * @property {import("./figure.js").Listener} on
 * @property {AbortSignal} signal
 */

/** @typedef {{ink: Record<string, string>, em: number, wide: (text: string) => number}} Style px */

export class PanelView {
  #canvas = h("canvas", {});
  #axes = new Axes();
  #key = new Legend();
  #title = h("h3", {});
  #header = h("header", {}, this.#title, this.#key.element);
  /** What the height of the header was found for. */
  #measured = "";
  #picture = h("div", { class: "figure-picture", role: "img" }, this.#axes.grid, this.#canvas, this.#axes.texts);
  #marks = h("div", { class: "figure-marks" });
  #grips = h("div", { class: "figure-grips" });
  #plot = h("div", { class: "figure-plot" }, this.#picture, this.#marks, this.#grips);
  #shared;
  #asking;
  #pointing;
  /** @type {Map<string, Handle>} */
  #handles = new Map();
  /** @type {Furniture|null} */
  #around = null;
  /** @type {Sheet|null} */
  #sheet = null;
  /** How much of its room stands around the box, px.
   *
   * @type {{across: number, up: number}|null} */
  around = null;

  element;

  /**
   * @param {Panel} panel
   * @param {Shared} shared
   */
  constructor(panel, shared) {
    this.panel = panel;
    this.#shared = shared;
    this.#asking = new PlaceQuestion((x, y) => shared.on.place?.(this.panel.id, x, y));
    this.#pointing = new Pointing(this.#plot, this.#picture, shared);
    this.#plot.append(...this.#pointing.elements, this.#asking.element);
    this.element = h("section", { class: "figure-panel", data: { panel: panel.id } }, this.#header, this.#plot);
  }

  /**
   * Take what is to be shown, and say which margins that needs. Nothing is painted yet.
   *
   * @param {Panel} panel
   * @param {Style} style
   * @param {boolean} sharesX
   * @returns {Margins}
   */
  prepare(panel, style, sharesX) {
    this.panel = panel;
    setText(this.#title, panel.title);
    this.#steady(this.#key.show(panel.traces, style.ink, style.em), style.em);
    this.element.classList.toggle("shares-x", sharesX);
    this.#around = furniture(panel, this.#room, style.em, style.wide, sharesX);
    return margins(this.#around, style.wide, style.em);
  }

  /**
   * Keep the header as high as it once had to be, so that nothing jumps when a number in the key gets shorter.
   *
   * @param {boolean} isOther Whether the key has changed.
   * @param {number} em px
   */
  #steady(isOther, em) {
    const now = `${this.element.clientWidth} ${em}`;
    if (now !== this.#measured) this.#header.style.minHeight = "";
    else if (!isOther) return;
    this.#measured = now;
    this.#header.style.minHeight = `${this.#header.offsetHeight}px`;
  }

  /**
   * Paint it.
   *
   * @param {Margins} around Those of all panels that stand above each other.
   * @param {Style} style
   * @param {{locked: boolean, ask: {along: "x"|"y"}|null, mark: Mark|null}} state
   */
  draw(around, { ink, em }, { locked, ask, mark }) {
    const { panel } = this;
    const room = this.#room;
    if (this.#around === null || !room.width || !room.height) return;
    const box = boxOf(panel, room, around, em);
    const { x, y } = scales(panel, box);
    this.#axes.show(box, { x, y }, this.#around, around.left, em, panel.traces.some(isCellMap));
    this.around = { across: around.left + around.right, up: around.bottom + GAP * em };
    const pen = this.#fit(room);
    const isCovered = panel.traces.some(({ kind }) => kind === "heat map");
    const sheet = { pen, box, x, y, axes: { x: panel.x, y: panel.y }, ink, unit: em / 13, cased: isCovered };
    this.#sheet = sheet;
    for (const { trace, among } of counted(panel.traces)) {
      within(sheet, OVER[trace.kind] * sheet.unit, () => kindOf(trace).paint(sheet, trace, among));
    }
    this.#turnable(locked || ask !== null);
    const axis = mark && panel[mark.along];
    this.#marks.replaceChildren(...(mark && axis ? markLines(mark, axis, sheet[mark.along], box) : []));
    this.#asking.show(ask && { box, scales: { x, y }, axes: sheet.axes, along: ask.along });
    this.#picture.setAttribute("aria-label", describe(panel, mark && axis ? wordsOf(mark, axis) : ""));
    this.#pointing.show(panel, sheet);
    Object.assign(this.#plot.dataset, { left: box.left, top: box.top, width: box.width, height: box.height });
  }

  /**
   * The values at a place of the page, once it is drawn.
   *
   * @param {{clientX: number, clientY: number}} place
   */
  valuesAt({ clientX, clientY }) {
    if (this.#sheet === null) return null;
    const { left, top } = this.#plot.getBoundingClientRect();
    return { x: this.#sheet.x.value(clientX - left), y: this.#sheet.y.value(clientY - top) };
  }

  get #room() {
    return { width: this.#plot.clientWidth, height: this.#plot.clientHeight };
  }

  /**
   * An empty canvas over the whole plot, on the pixels of the display.
   *
   * @param {{width: number, height: number}} room
   */
  #fit({ width, height }) {
    const canvas = this.#canvas;
    const { left, top } = this.#plot.getBoundingClientRect();
    const pixels = (/** @type {number} */ from, /** @type {number} */ extent) =>
      Math.round((from + extent) * devicePixelRatio) - Math.round(from * devicePixelRatio);
    const [across, down] = [pixels(left, width), pixels(top, height)];
    if (canvas.width !== across) canvas.width = across;
    if (canvas.height !== down) canvas.height = down;
    const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
    pen.setTransform(across / width, 0, 0, down / height, 0, 0);
    pen.clearRect(0, 0, width, height);
    return pen;
  }

  /**
   * The handles, each kept as long as its parameter has one.
   *
   * @param {boolean} locked
   */
  #turnable(locked) {
    const { panel } = this;
    if (this.#sheet === null) return;
    const { box, x, y } = this.#sheet;
    for (const [parameter, grip] of this.#handles) {
      if (panel.handles.some((handle) => handle.parameter === parameter)) continue;
      grip.element.remove();
      this.#handles.delete(parameter);
    }
    for (const { parameter, at, along } of panel.handles) {
      const grip = this.#grip(parameter);
      const axis = panel[along];
      const known = this.#shared.on.declared?.(parameter);
      grip.show({ box, scales: { x, y }, axis, along, at, bounds: boundsOf(axis, known), title: known?.title ?? axis.title, locked });
    }
  }

  /** @param {string} parameter */
  #grip(parameter) {
    const known = this.#handles.get(parameter);
    if (known !== undefined) return known;
    const { turn } = this.#shared.on;
    const grip = new Handle((value) => turn?.(parameter, value), turn ? "" : "fixed");
    grip.element.dataset.parameter = parameter;
    this.#handles.set(parameter, grip);
    this.#grips.append(grip.element);
    return grip;
  }
}
