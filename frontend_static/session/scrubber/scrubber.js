/**
 * The scrubber: the memory of the run, and the way back into it. Dragging shows the frame under the finger; letting go
 * stays there.
 */

import { enlargement } from "../../shared/canvas_size.js";
import { fill, h } from "../../shared/dom.js";
import { smallestSpan } from "../../shared/format.js";
import { explain } from "../../shared/terms.js";
import { onTheme, tokens } from "../../shared/theme.js";
import { coalesce, later, throttle } from "../../shared/timing.js";
import { isGone } from "../history.js";
import { BranchColumns } from "../plots/branch_columns.js";
import { columns } from "../plots/kinds/plot.js";
import { Shades } from "../plots/shades.js";
import { ofRole, samplers, valueOf } from "../series.js";
import { marks } from "../timeline.js";
import { Curves } from "./curves.js";
import { labels, paint, playhead } from "./paint.js";
import { Axis, rowOf, rowsWithout } from "./rows.js";
import { describe, goneOf, lossOf, missingOf, mixtureOf, weightOf } from "./description.js";

/** @import { SessionPublic } from "../../shared/messages.js" */
/** @import { Curve } from "../history.js" */
/** @import { Content } from "./paint.js" */

const REPAINT_MS = 100;
const SETTLE_MS = 1000;
const NEAR_PX = 7;
const NAMED = { "aria-label": "Position in the run", "aria-valuemin": 0, "aria-valuemax": 0, "aria-valuenow": 0 };
const INKS = ["ink", "muted", "well", "surface", "accent", "ramp", "hidden", "lost"];

export class Scrubber {
  #view;
  #canvas = h("canvas", { class: "scrubber-canvas" });
  #tip = h("div", { class: "tip", hidden: true });
  #slider = h(
    "div",
    { class: "scrubber small-print", role: "slider", tabindex: 0, ...NAMED },
    this.#canvas,
    this.#tip,
  );
  #names = h("ul", { class: "scrubber-rows small-print" });
  #named = "";
  /** All but the playhead, which moves more often than the rest changes. */
  #background = document.createElement("canvas");
  /**
   * The colours, once the session says which it has.
   *
   * @type {Record<string, string>|null}
   */
  #ink = null;
  #curves = { error: new Curves("error"), sigma: new Curves("sigma") };
  #hidden = new Shades("hidden", 1, (row) => row.hidden === true);
  /** A lane each.
   *
   * @type {Shades[]} */
  #lost = [];
  #happened = happenedIn([]);
  #axis = new Axis(600, 2);
  /** @type {import("./rows.js").Rows} */
  #rows = {};
  /** @type {import("../timeline.js").Mark[]} */
  #marks = [];
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
    fill(root, this.#slider, this.#names);
    this.#drawPlayhead = coalesce(() => this.#paintPlayhead(), view.signal);
    this.#drawAll = throttle(() => this.#paintAll(), REPAINT_MS, view.signal);
    view.store.on(["position", "computed"], () => {
      if (view.store.known.position === this.#settling) this.#settling = null;
      this.#drawPlayhead();
    });
    view.store.on(["timeline", "bookmarks", "branch", "branches", "history"], this.#drawAll);
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
    const frame = this.#axis.frame(this.#at(event)[0]);
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
    playhead({ pen, axis: this.#axis, rows: this.#rows, ink: this.#inks(session) }, position, session.computed);
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
    this.#axis = new Axis(width / this.#unit, session.frames);
    this.#marks = marks(session);
    const { error, sigma } = this.#curves;
    for (const each of [error, sigma]) each.update(this.#view.store);
    const missing = missingOf(session, this.#view.store.history, { error: error.isMeasured, sigma: sigma.isMeasured });
    this.#rows = rowsWithout(missing, height / this.#unit);
    this.#slider.dataset.rows = Object.keys(this.#rows).join(" ");
    const pen = /** @type {CanvasRenderingContext2D} */ (this.#background.getContext("2d"));
    pen.setTransform(ratio * this.#unit, 0, 0, ratio * this.#unit, 0, 0);
    const content = this.#content(session);
    paint({ pen, axis: this.#axis, rows: this.#rows, ink: this.#inks(session) }, content);
    this.#nameRows(content, session.recipe.experiment);
    this.#drawPlayhead();
  }

  /**
   * @param {Content} content
   * @param {string} experiment
   */
  #nameRows(content, experiment) {
    const rows = labels(this.#rows, content).map(({ label, middle }) => ({ label, middle: middle * this.#unit }));
    if (JSON.stringify(rows) === this.#named) return;
    this.#named = JSON.stringify(rows);
    fill(this.#names, rows.map(({ label, middle }) => h("li", { style: `top: ${middle}px` }, label)));
    explain(this.#names, { experiment });
  }

  /** @param {SessionPublic} session */
  #inks(session) {
    const declared = [...samplers(session).map(({ colour }) => colour), ...ofRole(session, "event").flatMap(({ colours }) => colours)];
    this.#ink ??= tokens(...INKS, ...declared);
    return this.#ink;
  }

  /**
   * @param {SessionPublic} session
   * @returns {Content}
   */
  #content(session) {
    const { store } = this.#view;
    const events = ofRole(session, "event");
    const names = events.map(({ name }) => name);
    if (names.join(" ") !== this.#happened.names.join(" ")) this.#happened = happenedIn(names);
    const [happened] = this.#happened.columns.update(store);
    const losses = store.losses.length > 0 ? store.losses : [{ history: store.history, colour: "lost" }];
    return {
      curves: this.#curves,
      history: store.history,
      thresholds: session.thresholds.filter(({ of }) => of === "sigma"),
      bookmarks: session.bookmarks.filter((mark) => !mark.branch || mark.branch === session.branch),
      marks: this.#marks,
      smallest: smallestSpan(session.unit),
      weight: weightOf(session),
      loss: lossOf(session),
      mixture: mixtureOf(session),
      events: events.map(({ name, colours }) => ({ colour: colours[0] ?? "ink", happened: happened?.data[name] ?? [] })),
      hidden: this.#hidden.trace(store),
      losses: losses.map(({ history, colour }, place) => {
        const shades = (this.#lost[place] ??= new Shades("lost", 1, isGone));
        return { ...shades.trace({ known: session, history }), ink: colour };
      }),
      gone: goneOf(store.history),
    };
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
    if (session === null || x < this.#axis.left - NEAR_PX) {
      tip.hidden = true;
      return;
    }
    fill(tip, this.#underPointer(x, y).map((line) => h("div", {}, line)));
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
    const isNear = (/** @type {{frame: number}} */ { frame }) => Math.abs(this.#axis.x(frame) - x) <= NEAR_PX;
    const change = y >= rowOf({ rows: this.#rows }, "changes")[1] && this.#marks.find(isNear);
    if (change) return [`from frame ${change.frame}`, ...change.lines];
    const bookmark = y <= rowOf({ rows: this.#rows }, "flags")[2] && store.known.bookmarks.find(isNear);
    if (bookmark) return [`frame ${bookmark.frame}`, bookmark.note || "bookmark"];
    return [describe(store, this.#axis.frame(x)).join(" · ")];
  }
}

/**
 * What happened in each frame of the active branch.
 *
 * @param {readonly string[]} names Of the series.
 */
function happenedIn(names) {
  /** @type {Record<string, Curve>} */
  const values = Object.fromEntries(names.map((name) => [name, (row) => valueOf(row, name)]));
  return { names, columns: new BranchColumns((history, from) => columns(history, from, values), { limits: [], onlyActive: true }) };
}
