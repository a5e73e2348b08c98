/** One panel on the page: its title and key, its axes and traces, its handles, and what is asked and marked in it. */

import { gradient, viridis } from "../colours.js";
import { h, setText } from "../dom.js";
import { TOP, boxOf, furniture, margins, paintGrid, plainAxis, scales, writeAxes } from "./axes.js";
import { Handle, PlaceQuestion, boundsOf, markLines, wordsOf } from "./handle.js";
import { KINDS } from "./kinds.js";
import { isCellMap, most } from "./maps.js";
import { within } from "./paint.js";
import { Pointing } from "./pointing.js";
import { describe, written } from "./scale.js";

/** @import { Tooltip } from "../tooltip.js" */
/** @import { Furniture, Margins, Style } from "./axes.js" */
/** @import { Mark } from "./handle.js" */
/** @import { Sheet } from "./paint.js" */
/** @import { Panel, Trace } from "./traces.js" */

/**
 * What a figure's panels share.
 *
 * @typedef {object} Shared
 * @property {Tooltip} tip
 * @property {import("./figure.js").Listener} on
 * @property {AbortSignal} signal
 */

/** Of a piece in the key, in units of the size of the letters. */
const [WIDE, HIGH] = [2, 1];
const INSET = 0.12;
/** Letters, px, at which a figure's lengths are what they say. */
const LETTERS_PX = 13;

export class PanelView {
  #canvas = h("canvas", {});
  #texts = h("div", { class: "figure-texts", "aria-hidden": "true" });
  #key = h("ul", { class: "figure-key" });
  #keyed = "";
  #title = h("h3", {});
  #header = h("header", {}, this.#title, this.#key);
  /** What the height of the header was found for. */
  #measured = "";
  #picture = h("div", { class: "figure-picture", role: "img" }, this.#canvas, this.#texts);
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
  #room = { left: 0, top: 0, width: 0, height: 0 };
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
   * Take what is to be shown, and write its title and key.
   *
   * @param {Panel} panel
   * @param {Style} style
   */
  take(panel, style) {
    this.panel = panel;
    setText(this.#title, panel.title);
    this.#entitle(panel.traces, style);
  }

  /**
   * Find the room that there is, once all panels have their titles, and say which margins what stands around the box needs.
   *
   * @param {Style} style
   * @param {boolean} sharesX
   * @returns {Margins}
   */
  measure(style, sharesX) {
    this.#room = this.#plot.getBoundingClientRect();
    this.#around = furniture(this.panel, this.#room, style, sharesX);
    return margins(this.#around, style);
  }

  /**
   * Write the key: what the panel shows, each with a small piece of it, painted by the same code. The header stays as high as
   * it once had to be, so that nothing jumps when a number in the key gets shorter.
   *
   * @param {readonly Trace[]} traces
   * @param {Style} style
   */
  #entitle(traces, { ink, em }) {
    const told = [...new Map(traces.filter(({ title }) => title !== "").map((trace) => [`${look(trace)} ${trace.title}`, trace])).values()];
    const now = JSON.stringify([told.map((trace) => [look(trace), trace.title, extent(trace)]), ink, em, devicePixelRatio]);
    const room = `${this.element.clientWidth} ${em}`;
    if (now === this.#keyed && room === this.#measured) return;
    if (now !== this.#keyed) {
      this.#key.replaceChildren(
        ...told.map((trace) => h("li", {}, piece(trace, ink, em), trace.title, extent(trace) && h("span", { class: "figure-extent" }, extent(trace)))),
      );
    }
    if (room !== this.#measured) this.#header.style.minHeight = "";
    this.#header.style.minHeight = `${this.#header.offsetHeight}px`;
    [this.#keyed, this.#measured] = [now, room];
  }

  /**
   * Paint it.
   *
   * @param {Margins} around Those of all panels that stand above each other.
   * @param {Style} style
   * @param {{locked: boolean, ask: {along: "x"|"y"}|null, mark: Mark|null}} state
   */
  draw(around, style, { locked, ask, mark }) {
    const { panel } = this;
    const { ink, em } = style;
    if (this.#around === null || !this.#room.width || !this.#room.height) return;
    const box = boxOf(panel, this.#room, around, em);
    this.around = { across: around.left + around.right, up: around.bottom + TOP * em };
    const isCovered = panel.traces.some(({ kind }) => kind === "heat map");
    const axes = { x: panel.x, y: panel.y };
    const sheet = { pen: this.#fit(), box, ...scales(panel, box), axes, ink, unit: em / LETTERS_PX, cased: isCovered };
    this.#sheet = sheet;
    if (!panel.traces.some(isCellMap)) paintGrid(sheet, this.#around, em);
    writeAxes(this.#texts, sheet, this.#around, around.left, style);
    for (const trace of panel.traces) {
      const { over, paint } = KINDS[trace.kind];
      within(sheet, over * sheet.unit, () => paint(sheet, trace, panel.traces));
    }
    this.#turnable(locked || ask !== null);
    const axis = mark && panel[mark.along];
    this.#marks.replaceChildren(...(mark && axis ? markLines(mark, axis, sheet[mark.along], box) : []));
    this.#asking.show(ask && { box, scales: { x: sheet.x, y: sheet.y }, axes, along: ask.along });
    this.#picture.setAttribute("aria-label", describe(panel, mark && axis ? wordsOf(mark, axis) : ""));
    this.#pointing.show(panel, sheet);
    Object.assign(this.#plot.dataset, { left: box.left, top: box.top, width: box.width, height: box.height });
  }

  /**
   * The values at a place of the page, once it is drawn, and how much of the axis to the right a px is; null beside the panel.
   *
   * @param {{clientX: number, clientY: number}} place
   */
  valuesAt({ clientX, clientY }) {
    const { left, top, width, height } = this.#plot.getBoundingClientRect();
    const [px, py] = [clientX - left, clientY - top];
    if (this.#sheet === null || px < 0 || px > width || py < 0 || py > height) return null;
    const { x, y } = this.#sheet;
    return { panel: this.panel.id, x: x.value(px), y: y.value(py), perPx: x.value(px + 1) - x.value(px) };
  }

  /** An empty canvas over the whole plot, on the pixels of the display. */
  #fit() {
    const canvas = this.#canvas;
    const { left, top, width, height } = this.#room;
    const pixels = (/** @type {number} */ from, /** @type {number} */ extent_) =>
      Math.round((from + extent_) * devicePixelRatio) - Math.round(from * devicePixelRatio);
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
      const axis = panel[along];
      const known = this.#shared.on.declared?.(parameter);
      const bounds = boundsOf(axis, known);
      this.#grip(parameter).show({ box, scales: { x, y }, axis, along, at, bounds, title: known?.title ?? axis.title, locked });
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

/**
 * What tells one trace in a key from another.
 *
 * @param {Trace} trace
 */
function look(trace) {
  const { kind, ink } = trace;
  const more = { dashed: "dashed" in trace && trace.dashed, stacked: "stacked" in trace && trace.stacked, area: "area" in trace && trace.area !== null };
  return JSON.stringify([kind, ink, more, "along" in trace && trace.along]);
}

/** @param {Trace} trace */
function extent(trace) {
  return trace.kind === "heat map" && "values" in trace ? `0 to ${written(Number(most(trace).toPrecision(2)))}` : "";
}

/**
 * @param {Trace} trace
 * @param {Record<string, string>} ink
 * @param {number} em
 */
function piece(trace, ink, em) {
  if (trace.kind === "heat map") {
    const bar = h("span", { class: "figure-bar", "aria-hidden": "true" });
    bar.style.background = gradient(viridis);
    return bar;
  }
  const [width, height] = [WIDE * em, HIGH * em];
  const canvas = h("canvas", { width: Math.round(width * devicePixelRatio), height: Math.round(height * devicePixelRatio), "aria-hidden": "true" });
  const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  pen.scale(devicePixelRatio, devicePixelRatio);
  const box = { left: INSET * em, top: INSET * em, width: width - 2 * INSET * em, height: height - 2 * INSET * em };
  const isBars = trace.kind === "bars" && !trace.stacked;
  const axes = { x: plainAxis(isBars ? { low: -0.5, high: 1.5 } : { low: 0, high: 1 }), y: plainAxis({ low: 0, high: 1 }) };
  const { paint, sample } = KINDS[trace.kind];
  paint({ pen, box, ...scales(axes, box), axes, ink, unit: em / LETTERS_PX, cased: false }, sample?.(trace) ?? trace, []);
  return canvas;
}
