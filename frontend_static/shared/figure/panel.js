/** One panel on the page: its title and key, its axes and traces, its handles, and its question and marks. */

import { h, html, render } from "../../vendor/preact.js";
import { build, setText, step, tip } from "../dom.js";
import { gradient, viridis } from "../theme.js";
import { coalesce } from "../timing.js";
import { boxOf, describe, furniture, inPx, margins, paintGrid, plainAxis, scales, TOP, writeAxes, written } from "./axes.js";
import { boundsOf, Handle, markLines, PlaceQuestion, wordsOf } from "./handle.js";
import { KINDS } from "./kinds.js";
import { cellHit, cellsOf, isCellMap, most, REACH, within } from "./paint.js";

/** @import { Furniture, Margins, Style } from "./axes.js" */
/** @import { Mark } from "./handle.js" */
/** @import { Hit, Sheet } from "./paint.js" */
/** @import { Cell, Panel, Trace } from "./traces.js" */

/**
 * The nearest of the numbers 0..count-1.
 *
 * @param {number} value
 * @param {number} count
 */
function clamp(value, count) {
  return Math.min(Math.max(value, 0), count - 1);
}

/** The shared data of a figure's panels.
 *
 * @typedef {object} Shared
 * @property {import("./figure.js").Listener} on
 * @property {AbortSignal} signal
 */

/** Size of a sample in the key, in units of the font size. */
const [WIDE, HIGH] = [2, 1];
const INSET = 0.12;
/** Font size, px, at which a figure's lengths are exact. */
const LETTERS_PX = 13;

export class PanelView {
  #canvas = build("canvas", {});
  #texts = build("div", { class: "figure-texts", "aria-hidden": "true" });
  #key = build("ul", { class: "figure-key" });
  #keyed = "";
  #title = build("h3", {});
  #header = build("header", {}, this.#title, this.#key);
  /** The inputs for which the header's height was measured. */
  #measured = "";
  #picture = build("div", { class: "figure-picture", role: "img" }, this.#canvas, this.#texts);
  /** The component of the lines across it. */
  #lines = build("div", { class: "made" });
  #chosen = build("span", { class: "figure-ring", hidden: true });
  #ring = build("span", { class: "figure-ring cursor", hidden: true });
  #rings = build("div", { class: "figure-rings", "aria-hidden": "true" }, this.#chosen, this.#ring);
  /** Marks the place at the pointer. */
  #spot = build("span", { class: "figure-spot", hidden: true });
  #plot = build("div", { class: "figure-plot" }, this.#picture, this.#rings, this.#spot, this.#lines);
  #shared;
  /** @type {PointerEvent|null} */
  #pointer = null;
  /** The cell at the keyboard cursor.
   *
   * @type {Cell|null} */
  #at = null;
  #soon;
  /** @type {Furniture|null} */
  #around = null;
  #room = { left: 0, top: 0, width: 0, height: 0 };
  /** @type {Sheet|null} */
  #sheet = null;
  /** Margins around the box, px.
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
    this.element = build("section", { class: "figure-panel", data: { panel: panel.id } }, this.#header, this.#plot);
    this.#soon = coalesce(() => this.#point(), shared.signal);
    const picture = this.#picture;
    for (const type of /** @type {const} */ (["pointermove", "pointerdown", "pointerleave"])) {
      this.#plot.addEventListener(type, (event) => {
        this.#pointer = type === "pointerleave" ? null : event;
        this.#soon();
      });
    }
    picture.addEventListener("click", (event) => {
      const cell = this.#hit(event)?.cell;
      if (cell === undefined) return;
      tip.hide();
      this.#choose(cell);
    });
    picture.addEventListener("keydown", (event) => this.#press(event));
    picture.addEventListener("focus", () => {
      if (this.#map !== null && picture.matches(":focus-visible")) this.#go(this.#start);
    });
    picture.addEventListener("blur", () => {
      if (this.#map !== null && this.#pointer === null) this.#tell(null);
      this.#surround();
    });
  }

  /** Take new content, and write its title and key.
   *
   * @param {Panel} panel
   * @param {Style} style
   */
  take(panel, style) {
    this.panel = panel;
    setText(this.#title, panel.title);
    if (panel.title === "") this.#title.remove();
    else if (this.#title.parentElement === null) this.#header.prepend(this.#title);
    this.#entitle(panel.traces, style);
  }

  /** Measure the available room, once all panels have their titles, and return the margins that the labels need.
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

  /** Write the key: each entry has a small sample, painted by the same code. The header never shrinks, so that nothing jumps when a number
   * in the key gets shorter.
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
        ...told.map((trace) => build("li", {}, piece(trace, ink, em), trace.title, extent(trace) && build("span", { class: "figure-extent" }, extent(trace)))),
      );
    }
    if (room !== this.#measured) this.#header.style.minHeight = "";
    this.#header.style.minHeight = `${this.#header.offsetHeight}px`;
    [this.#keyed, this.#measured] = [now, room];
  }

  /** Paint the panel.
   *
   * @param {Margins} around Margins of all panels in the column.
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
    const axis = mark && panel[mark.along];
    render(html`
      <div class="figure-marks">${mark && axis && markLines(mark, axis, sheet[mark.along], box)}</div>
      <div class="figure-grips">${panel.handles.map((handle) => this.#handle(handle, sheet, locked || ask !== null))}</div>
      ${ask && h(PlaceQuestion, { stand: standInMiddle(ask.along, sheet), place: (value) => this.#shared.on.place?.(value) })}
    `, this.#lines);
    this.#picture.setAttribute("aria-label", describe(panel, mark && axis ? wordsOf(mark, axis) : ""));
    if (this.#map !== null) {
      const attributes = { role: "application", "aria-roledescription": "heat map", tabindex: "0" };
      for (const [name, value] of Object.entries(attributes)) this.#picture.setAttribute(name, value);
    }
    this.#surround();
    // The hit may have moved away.
    if (this.#pointer !== null) this.#soon();
    Object.assign(this.#plot.dataset, { left: box.left, top: box.top, width: box.width, height: box.height });
  }

  /**
   * @param {Panel["handles"][number]} handle
   * @param {Sheet} sheet
   * @param {boolean} locked
   */
  #handle({ parameter, at, along }, { axes: { [along]: axis }, box, [along]: scale }, locked) {
    const { declared, turn } = this.#shared.on;
    const known = declared?.(parameter);
    const stand = { box, scale, axis, along, at, bounds: boundsOf(axis, known), title: known?.title ?? axis.title, locked };
    return h(Handle, { key: parameter, stand, parameter, tell: turn && ((value) => turn(parameter, value)) });
  }

  /** The values at a place of the page, once the panel is drawn, and the extent of a px on the x axis; null outside the panel.
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

  // The tooltip at the pointer or, with cells, at the keyboard cursor; and the choice of a cell, with rings around the cursor's and the
  // chosen cell.

  /** The map whose cells can be chosen, if there is one. */
  get #map() {
    return this.panel.traces.find(isCellMap) ?? null;
  }

  /** The cursor's cell when the keys take over. */
  get #start() {
    return this.#at ?? this.#map?.chosen ?? { i: 0, j: 0 };
  }

  /** Show the tooltip of the pointer, unless it is moving something. */
  #point() {
    const hit = this.#pointer && this.#hit(this.#pointer);
    this.#picture.classList.toggle("choosing", Boolean(hit?.cell));
    this.#tell(hit);
  }

  /** @param {Hit|null} hit Null for nothing. */
  #tell(hit) {
    const words = hit?.cell ? this.#shared.on.describe?.(hit.cell) : hit?.words;
    this.#spot.hidden = !hit || hit.cell !== undefined;
    if (!hit || !words) {
      tip.hide();
      return;
    }
    const { left, top } = this.#plot.getBoundingClientRect();
    Object.assign(this.#spot.style, inPx({ left: hit.x, top: hit.y }));
    tip.show(words, { x: left + hit.x, y: top + hit.y, below: top + (hit.below ?? hit.y) });
  }

  /** The nearest hit within reach of the pointer; of equal ones the one in front.
   *
   * @param {MouseEvent} event
   */
  #hit({ clientX, clientY, target }) {
    const sheet = this.#sheet;
    if (sheet === null || !(target instanceof Node) || !this.#picture.contains(target)) return null;
    const around = this.#plot.getBoundingClientRect();
    const [px, py] = [clientX - around.left, clientY - around.top];
    const { left, top, width, height } = sheet.box;
    if (px < left || px > left + width || py < top || py > top + height) return null;
    const { traces } = this.panel;
    /** @type {Hit|null} */
    let nearest = null;
    for (const trace of traces) {
      const hit = KINDS[trace.kind].near?.(sheet, trace, px, py, traces) ?? null;
      if (hit !== null && hit.distance <= Math.min(REACH * sheet.unit, nearest?.distance ?? Infinity)) nearest = hit;
    }
    return nearest;
  }

  #surround() {
    const [map, sheet] = [this.#map, this.#sheet];
    const cursor = this.#picture.matches(":focus-visible") ? this.#at : null;
    for (const [ring, cell] of /** @type {const} */ ([[this.#chosen, map?.chosen ?? null], [this.#ring, cursor]])) {
      ring.hidden = map === null || cell === null || cell.i >= map.across || cell.j >= map.up;
      if (!ring.hidden && sheet && map && cell) Object.assign(ring.style, inPx(cellsOf(sheet, map).box(cell)));
    }
  }

  /** Move the keyboard cursor to a cell.
   *
   * @param {Cell} cell
   */
  #go(cell) {
    this.#pointer = null;
    this.#at = cell;
    this.#tell(this.#sheet && this.#map && cellHit(this.#sheet, this.#map, cell));
    this.#surround();
  }

  /** @param {Cell} cell */
  #choose(cell) {
    // The keys continue from there.
    this.#at = cell;
    this.#shared.on.choose?.(cell);
    this.#surround();
  }

  /** @param {KeyboardEvent} event */
  #press(event) {
    const map = this.#map;
    if (map === null || event.ctrlKey || event.metaKey || event.altKey) return;
    const now = this.#start;
    const way = step(event);
    if (way !== null) this.#go({ i: clamp(now.i + way[0], map.across), j: clamp(now.j - way[1], map.up) });
    else if (event.key === "Home" || event.key === "End") this.#go({ i: event.key === "Home" ? 0 : map.across - 1, j: now.j });
    else if (event.key === "Enter" || event.key === " ") this.#choose(now);
    else if (event.key === "Escape") this.#tell(null);
    else return;
    event.preventDefault();
  }
}

/** Return the first place of a prediction: the middle.
 *
 * @param {"x"|"y"} along
 * @param {Sheet} sheet
 */
function standInMiddle(along, { box, axes: { [along]: axis }, [along]: scale }) {
  const at = scale.value(along === "x" ? box.left + box.width / 2 : box.top + box.height / 2);
  return { box, scale, axis, along, at, bounds: boundsOf(axis), title: "your prediction", locked: false };
}

/** The identity of a trace in a key.
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
    const bar = build("span", { class: "figure-bar", "aria-hidden": "true" });
    bar.style.background = gradient(viridis);
    return bar;
  }
  const [width, height] = [WIDE * em, HIGH * em];
  const canvas = build("canvas", { width: Math.round(width * devicePixelRatio), height: Math.round(height * devicePixelRatio), "aria-hidden": "true" });
  const pen = /** @type {CanvasRenderingContext2D} */ (canvas.getContext("2d"));
  pen.scale(devicePixelRatio, devicePixelRatio);
  const box = { left: INSET * em, top: INSET * em, width: width - 2 * INSET * em, height: height - 2 * INSET * em };
  const isBars = trace.kind === "bars" && !trace.stacked;
  const axes = { x: plainAxis(isBars ? { low: -0.5, high: 1.5 } : { low: 0, high: 1 }), y: plainAxis({ low: 0, high: 1 }) };
  const { paint, sample } = KINDS[trace.kind];
  paint({ pen, box, ...scales(axes, box), axes, ink, unit: em / LETTERS_PX, cased: false }, sample?.(trace) ?? trace, []);
  return canvas;
}
