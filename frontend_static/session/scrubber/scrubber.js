/**
 * The scrubber: the memory of the run, and the way back into it. Dragging shows the frame under the finger; letting go
 * stays there.
 */

import { build, fill } from "../../shared/dom.js";
import { percent, quantity } from "../../shared/format.js";
import { explain } from "../../shared/terms.js";
import { enlargement, onTheme, tokens } from "../../shared/theme.js";
import { coalesce, follow, later, throttle } from "../../shared/timing.js";
import { eventsOf, numberOf, ofRole, samplers } from "../readings.js";
import { curve, isGone } from "../store.js";
import { Memory } from "./paint.js";

/** @import { SessionPublic } from "../../shared/messages.js" */

const REPAINT_MS = 100;
const SETTLE_MS = 1000;
const NEAR_PX = 7;
const NAMED = { "aria-label": "Position in the run", "aria-valuemin": 0, "aria-valuemax": 0, "aria-valuenow": 0 };
const INKS = ["ink", "muted", "well", "surface", "accent", "ramp", "hidden", "lost"];

export class Scrubber {
  #view;
  #canvas = build("canvas", { class: "scrubber-canvas" });
  #tip = build("div", { class: "tip", hidden: true });
  #slider = build(
    "div",
    { class: "scrubber small-print", role: "slider", tabindex: 0, ...NAMED },
    this.#canvas,
    this.#tip,
  );
  #names = build("ul", { class: "scrubber-rows small-print" });
  #named = "";
  /** All but the playhead, which moves more often than the rest changes. */
  #background = document.createElement("canvas");
  /**
   * The colours, once the session says which it has.
   *
   * @type {Record<string, string>|null}
   */
  #ink = null;
  #memory;
  /** px of the page for what is 1 px of the scrubber. */
  #unit = 1;
  /** The frame under the finger; then the one where it was let go, until the session is there. */
  /** @type {number|null} */
  #dragged = null;
  /** @type {number|null} */
  #settling = null;
  #drawPlayhead;
  #drawAll;

  /**
   * @param {HTMLElement} root
   * @param {import("../mount.js").View} view
   */
  constructor(root, view) {
    this.#view = view;
    this.#memory = new Memory(view.store);
    fill(root, this.#slider, this.#names);
    this.#drawPlayhead = coalesce(() => this.#paintPlayhead(), view.signal);
    this.#drawAll = throttle(() => this.#paintAll(), REPAINT_MS, view.signal);
    const { store, signal } = view;
    const move = () => {
      if (store.session?.position === this.#settling) this.#settling = null;
      this.#drawPlayhead();
    };
    follow(() => [store.session?.position, store.session?.computed], move, signal);
    follow(() => [store.session?.timeline, store.session?.bookmarks, store.session?.branch, store.lengths], this.#drawAll, signal);
    const sizes = new ResizeObserver(this.#drawAll);
    sizes.observe(this.#slider);
    view.signal.addEventListener("abort", () => sizes.disconnect());
    onTheme(() => {
      this.#ink = null;
      this.#paintAll();
      this.#paintPlayhead();
    }, view.signal);
    this.#listen();
  }

  #listen() {
    const slider = this.#slider;
    slider.addEventListener("pointerdown", (event) => {
      if (event.button !== 0 || !this.#view.able) return;
      slider.setPointerCapture(event.pointerId);
      this.#drag(event);
    });
    slider.addEventListener("pointermove", (event) => {
      if (this.#dragged !== null) this.#drag(event);
      this.#hint(...this.#at(event));
    });
    for (const end of ["pointerup", "pointercancel"]) slider.addEventListener(end, () => this.#release());
    slider.addEventListener("pointerleave", () => {
      this.#tip.hidden = true;
    });
  }

  /**
   * @param {MouseEvent} event
   * @returns {[number, number]} Where an event happened, px of the scrubber from its corner.
   */
  #at(event) {
    const box = this.#slider.getBoundingClientRect();
    return [(event.clientX - box.left) / this.#unit, (event.clientY - box.top) / this.#unit];
  }

  /** @param {MouseEvent} event */
  #drag(event) {
    const frame = this.#memory.axis.frame(this.#at(event)[0]);
    if (frame === this.#dragged) return;
    this.#dragged = frame;
    this.#view.steering.seek(frame);
    this.#drawPlayhead();
  }

  #release() {
    if (this.#dragged === null) return;
    const { steering, signal } = this.#view;
    this.#settling = this.#dragged;
    this.#dragged = null;
    const settle = () => {
      this.#settling = null;
      this.#drawPlayhead();
    };
    steering.seek(this.#settling).finally(() => later(settle, SETTLE_MS, signal));
    this.#drawPlayhead();
  }

  #paintPlayhead() {
    const { store } = this.#view;
    const { session } = store;
    if (session === null) return;
    const pen = /** @type {CanvasRenderingContext2D} */ (this.#canvas.getContext("2d"));
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.clearRect(0, 0, this.#canvas.width, this.#canvas.height);
    pen.drawImage(this.#background, 0, 0);
    const ratio = (this.#canvas.width / (this.#slider.clientWidth || 1)) * this.#unit;
    pen.scale(ratio, ratio);
    const position = this.#dragged ?? this.#settling ?? session.position;
    this.#memory.playhead({ pen, ink: this.#inks(session) }, position, session.computed);
    this.#slider.setAttribute("aria-valuemax", String(session.frames - 1));
    this.#slider.setAttribute("aria-valuenow", String(position));
    this.#slider.setAttribute("aria-valuetext", describe(store, position).join(", "));
  }

  #paintAll() {
    const { session } = this.#view.store;
    const { clientWidth: width, clientHeight: height } = this.#slider;
    if (session === null || width === 0) return;
    const ratio = globalThis.devicePixelRatio || 1;
    this.#unit = enlargement(this.#slider);
    for (const one of [this.#canvas, this.#background]) {
      if (one.width !== Math.round(width * ratio)) one.width = Math.round(width * ratio);
      if (one.height !== Math.round(height * ratio)) one.height = Math.round(height * ratio);
    }
    const memory = this.#memory;
    memory.arrange(width / this.#unit, height / this.#unit);
    this.#slider.dataset.rows = Object.keys(memory.rows).join(" ");
    const pen = /** @type {CanvasRenderingContext2D} */ (this.#background.getContext("2d"));
    pen.setTransform(ratio * this.#unit, 0, 0, ratio * this.#unit, 0, 0);
    memory.paint({ pen, ink: this.#inks(session) });
    this.#nameRows(session.recipe.experiment);
    this.#drawPlayhead();
  }

  /** @param {string} experiment */
  #nameRows(experiment) {
    const rows = this.#memory.labels.map(({ label, middle }) => ({ label, middle: middle * this.#unit }));
    if (JSON.stringify(rows) === this.#named) return;
    this.#named = JSON.stringify(rows);
    fill(this.#names, rows.map(({ label, middle }) => build("li", { style: `top: ${middle}px` }, label)));
    explain(this.#names, { experiment });
  }

  /** @param {SessionPublic} session */
  #inks(session) {
    const declared = [...samplers(session).map(({ colour }) => colour), ...ofRole(session, "event").flatMap(({ colours }) => colours)];
    this.#ink ??= tokens(...INKS, ...declared);
    return this.#ink;
  }

  /**
   * Say what is under the pointer.
   *
   * @param {number} x
   * @param {number} y
   */
  #hint(x, y) {
    const { store } = this.#view;
    const { session } = store;
    const tip = this.#tip;
    if (session === null || x < this.#memory.axis.left - NEAR_PX) {
      tip.hidden = true;
      return;
    }
    fill(tip, this.#underPointer(x, y).map((line) => build("div", {}, line)));
    tip.hidden = false;
    const width = tip.offsetWidth;
    tip.style.left = `${Math.min(Math.max(4, x * this.#unit - width / 2), this.#slider.clientWidth - width - 4)}px`;
  }

  /**
   * @param {number} x
   * @param {number} y
   */
  #underPointer(x, y) {
    const { store } = this.#view;
    const { marks, rows } = this.#memory;
    const isNear = (/** @type {{frame: number}} */ { frame }) => Math.abs(this.#memory.axis.x(frame) - x) <= NEAR_PX;
    const change = y >= (rows.changes?.[1] ?? Infinity) && marks.find(isNear);
    if (change) return [`from frame ${change.frame}`, ...change.lines];
    const bookmark = y <= (rows.flags?.[2] ?? 0) && store.known.bookmarks.find(isNear);
    if (bookmark) return [`frame ${bookmark.frame}`, bookmark.note || "bookmark"];
    return [describe(store, this.#memory.axis.frame(x)).join(" · ")];
  }
}

/**
 * A frame in words.
 *
 * @param {import("../store.js").Store} store
 * @param {number} frame
 * @returns {string[]}
 */
function describe({ known: session, history }, frame) {
  const row = history.at(frame);
  const unit = session.unit;
  if (!row) return [`frame ${frame}`, "not computed yet"];
  const told = [`frame ${frame}`];
  if (curve.error(row) !== null) told.push(`error ${quantity(curve.error(row), unit)} ${unit}`.trim());
  if (curve.sigma(row) !== null) told.push(`sigma ${quantity(curve.sigma(row), unit)} ${unit}`.trim());
  if (row.searching) told.push(`no ${session.target}`);
  else if (isGone(row)) told.push("lost");
  else if (row.hidden) told.push("hidden");
  const probability = numberOf(session, "loss_probability", row);
  if (probability !== null) told.push(`lost with ${percent(probability)}`);
  told.push(...eventsOf(session, row).map(({ title }) => title));
  return told;
}
