/** The live plots: the experiment's plots as panels of one figure over one axis of frames. If their place has `data-shown="first"`, and in
 a presentation, two are shown: the error and the first other one. The axis can be zoomed (`Zoom`). */

import { build } from "../../shared/dom.js";
import { plainAxis } from "../../shared/figure/axes.js";
import { FigureView } from "../../shared/figure/figure.js";
import { lineOver, told } from "../../shared/figure/kinds.js";
import { explain } from "../../shared/terms.js";
import { follow, throttle, until } from "../../shared/timing.js";
import { signal } from "../../vendor/preact.js";
import { samplers } from "../readings.js";
import { steer } from "../steering.js";
import { curve } from "../store.js";
import { KINDS } from "./kinds.js";

/** @import { Panel, Spans, Trace } from "../../shared/figure/traces.js" */
/** @import { Plot, SessionPublic } from "../../shared/messages.js" */
/** @import { View } from "../mount.js" */
/** @import { Curve, History, Row, Store } from "../store.js" */
/** @import { Kind } from "./kinds.js" */

// The numbers of a history in columns, values derived from it, and the limits of axes.

const STEPS = [1, 1.5, 2, 3, 4, 5, 7.5, 10];

/** @type {WeakMap<History, Map<Curve, {edition: number, values: number[]}>>} */
const columns = new WeakMap();

/** A number for all frames, NaN where unknown. If the history has only grown, only new frames are read.
 *
 * @param {History} history
 * @param {Curve} read The same function each time.
 * @returns {readonly number[]}
 */
export function column(history, read) {
  const known = columns.get(history) ?? new Map();
  columns.set(history, known);
  let found = known.get(read);
  if (found?.edition !== history.edition || found.values.length > history.length) {
    found = { edition: history.edition, values: [] };
    known.set(read, found);
  }
  for (let frame = found.values.length; frame < history.length; frame += 1) found.values.push(read(history.at(frame)) ?? NaN);
  return found.values;
}

/** The result of `make` for a history, cached until the history changes.
 *
 * @template T
 * @param {(history: History) => T} make
 * @returns {(history: History) => T}
 */
export function remembered(make) {
  /** @type {WeakMap<History, {seen: string, value: T}>} */
  const known = new WeakMap();
  return (history) => {
    const seen = `${history.edition} ${history.length}`;
    const before = known.get(history);
    const found = before?.seen === seen ? before : { seen, value: make(history) };
    known.set(history, found);
    return found.value;
  };
}

/** Shades of the intervals in which a test holds, with a word in the key if there are any.
 *
 * @param {string} ink
 * @param {number} opacity
 * @param {(row: Row, place: number) => boolean} test Test of a frame, and of a row if there are rows.
 * @param {{word?: string, rows?: number}} [options] Number of separately shaded rows.
 * @returns {(history: History) => Spans}
 */
export function shades(ink, opacity, test, { word = "", rows = 1 } = {}) {
  const intervals = remembered((history) =>
    Array.from({ length: rows }, (_, place) => {
      const part = rows > 1 ? { low: place, high: place + 1 } : {};
      return history.spans((row) => test(row, place)).map(([first, last]) => ({ first: first - 0.5, last: last + 0.5, ...part }));
    }).flat(),
  );
  return (history) => {
    const found = intervals(history);
    return { kind: "spans", title: found.length > 0 ? word : "", name: ink, ink, opacity, intervals: found };
  };
}

/** The smallest and largest of all values; inverted if there are none.
 *
 * @param {readonly (readonly number[])[]} all
 * @returns {[number, number]}
 */
export function extent(all) {
  let [low, high] = [Infinity, -Infinity];
  for (const values of all) {
    for (const value of values) {
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  return [low, high];
}

/** A rounded range from 0 to beyond a value, which changes seldom so that nothing jumps.
 *
 * @param {number} most
 */
export function reach(most) {
  const value = most * 1.05;
  const power = 10 ** Math.floor(Math.log10(value));
  return power * (STEPS.find((step) => step * power >= value) ?? value / power);
}

/** A rounded range around values that may be far from 0.
 *
 * @param {[number, number]} extent The smallest and the largest value.
 * @param {number} smallest Least extent of the range.
 * @returns {{low: number, high: number}}
 */
export function enclose([low, high], smallest) {
  if (low > high) return { low: 0, high: smallest };
  const span = Math.max(high - low, smallest);
  const step = 10 ** Math.floor(Math.log10(span / 2));
  const start = Math.floor(low / step) * step;
  return { low: start, high: Math.max(Math.ceil(high / step) * step, start + smallest) };
}

// The frames that the plots of a session show: all, or a zoomed range. The wheel with Ctrl, or two
// fingers on a touchpad, zoom at the pointer; dragging moves the zoomed range; a double click shows all again. The keys +, - and
// 0 of the session do the same at the shown frame (`keys.js`).

/** @typedef {[low: number, high: number]} Frames */

/** Zoom per px of the wheel. */
const RATE = 1 / 300;
/** Least number of shown frames. */
const FEWEST = 4;
const MOVED_PX = 4;

class Zoom {
  #at;
  #last = 1;
  #window = signal(/** @type {Frames|null} */ (null));
  /** Whether the pointer that went down last has moved the window. */
  #isMoved = false;

  /**
   * @param {HTMLElement} place Element of the plots.
   * @param {(event: MouseEvent) => {x: number, perPx: number}|null} at Returns the frame under the pointer, and frames per px.
   */
  constructor(place, at) {
    this.#at = at;
    place.addEventListener("wheel", (event) => this.#wheel(event), { passive: false });
    place.addEventListener("dblclick", () => this.by(0, null));
    place.addEventListener("pointerdown", (event) => this.#drag(event));
    place.addEventListener("click", (event) => this.#click(event), { capture: true });
  }

  /** The shown frames; readers follow it as a signal.
   *
   * @param {number} last Number of the last frame.
   * @returns {Frames}
   */
  within(last) {
    this.#last = last;
    return (this.#window.value && clamped(this.#window.value, last)) ?? [0, last];
  }

  /**
   * @param {number} at
   * @param {number|null} factor Above 1 to see more frames around this one; null for all.
   */
  by(at, factor) {
    this.#window.value = factor === null ? null : clamped(scaled(this.within(this.#last), at, factor), this.#last);
  }

  /** @param {WheelEvent} event */
  #wheel(event) {
    const found = event.ctrlKey || event.metaKey ? this.#at(event) : null;
    if (found === null) return;
    event.preventDefault();
    this.by(found.x, Math.exp(event.deltaY * RATE));
  }

  /** @param {MouseEvent} event */
  #click(event) {
    // A drag is not a choice.
    if (this.#isMoved) event.stopImmediatePropagation();
    this.#isMoved = false;
  }

  /** @param {PointerEvent} begun */
  #drag(begun) {
    this.#isMoved = false;
    const [window, held] = [this.#window.peek(), this.#at(begun)];
    if (window === null || held === null || begun.button !== 0 || begun.pointerType === "touch") return;
    const end = new AbortController();
    const move = (/** @type {PointerEvent} */ event) => {
      const px = event.clientX - begun.clientX;
      this.#isMoved ||= Math.abs(px) >= MOVED_PX;
      if (this.#isMoved) this.#window.value = clamped([window[0] - px * held.perPx, window[1] - px * held.perPx], this.#last);
    };
    document.addEventListener("pointermove", move, { signal: end.signal });
    for (const type of /** @type {const} */ (["pointerup", "pointercancel"])) document.addEventListener(type, () => end.abort(), { signal: end.signal });
  }
}

/**
 * A window widened or narrowed around a frame.
 *
 * @param {Frames} window
 * @param {number} at
 * @param {number} factor Above 1 to see more.
 * @returns {Frames}
 */
export function scaled([low, high], at, factor) {
  const wanted = Math.max(FEWEST, (high - low) * factor);
  const real = wanted / (high - low || 1);
  return [at - (at - low) * real, at + (high - at) * real];
}

/** The nearest window within the existing frames; null if it has all.
 *
 * @param {Frames} window
 * @param {number} last
 * @returns {Frames|null}
 */
export function clamped([low, high], last) {
  const span = high - low;
  if (span >= last) return null;
  const start = Math.min(Math.max(0, low), last - span);
  return [start, start + span];
}

/** @typedef {Kind & {plot: Plot}} Drawn The plot has the unit in which it is drawn. */

const REDRAW_MS = 100;
/** In a narrower session the plots are a row of sparklines. */
const WIDE_PX = 1000;
/** Width from which the plots have room for full names. */
const ROOMY_PX = 350;
/** Fields of a session that affect the plots, in addition to its histories. */
const DRAWN = /** @type {const} */ (["branch", "doubts", "parameters", "position", "playing", "thresholds", "tracker"]);
/** Size of the numbers at the axes, in that of the page's letters. */
const LETTERS = 11 / 16;
/** Heights, px: of a plot, and of one with rows, its base and the height per row. */
const [PLOT_PX, BESIDE_PX, ROW_PX] = [66, 52, 15];

/** Put the plots into a place once the session is known.
 *
 * @param {HTMLElement} root
 * @param {View} view
 */
export async function plots(root, view) {
  const { store, signal: end } = view;
  await until(() => store.session?.plots.length, end);
  const session = store.known;
  const all = session.plots.filter(({ id }) => view.plots.length === 0 || view.plots.includes(id)).map((each) => {
    const plot = { ...each, unit: unitOf(each, session.unit) };
    return { plot, ...KINDS[plot.kind](plot, session) };
  });
  const place = build("div", { class: "plots-figure", role: "group", "aria-label": "Plots" });
  root.append(build("h2", { class: "visually-hidden" }, "Plots"), place);
  const on = {
    turn: (/** @type {string} */ parameter, /** @type {number} */ value) => steer(store, { kind: "change", values: { [parameter]: value } }),
    declared: () => ({ title: "shown hypothesis", unit: "", minimum: 1, maximum: null, step: 1 }),
  };
  const figure = new FigureView(place, on, end, { isCompact: true, letters: LETTERS, inks: samplers(session).map(({ colour }) => colour) });
  const zoom = new Zoom(place, (event) => figure.valuesAt(event));
  const frames = () => zoom.within(Math.max(1, store.known.frames - 1));
  const outer = root.closest(".session-view, .comparison") ?? root;
  const draw = throttle(() => {
    if (document.hidden) return;
    const measured = all.filter((each) => isMeasured(each, store));
    const isFolded = root.dataset.shown === "first" || "presenting" in document.documentElement.dataset;
    // The keyboard scrolls only tab stops; two plots have no more than their room.
    root.tabIndex = isFolded ? -1 : 0;
    const isSparkline = outer.clientWidth < WIDE_PX;
    root.classList.toggle("sparklines", isSparkline);
    const look = { frames: frames(), isSparkline, isRoomy: root.clientWidth >= ROOMY_PX };
    const panels = (isFolded ? firstOf(measured, store) : measured).map((each, row) => panelOf(each, store, look, row));
    figure.show({ panels }, { locked: !view.store.isSteerable });
    explainTitles(place, session);
  }, REDRAW_MS, end);
  place.addEventListener("click", (event) => {
    const at = store.isReadOnly ? null : figure.valuesAt(event);
    if (at !== null) all.find(({ plot }) => plot.id === at.panel)?.choose?.(view, Math.round(at.x), at.y);
  });
  follow(() => [store.connection.value, store.ensemble.value, store.lengths, frames(), DRAWN.map((name) => store.known[name])], draw, end);
  document.addEventListener("visibilitychange", draw, { signal: end });
  const [sizes, asked] = [new ResizeObserver(draw), new MutationObserver(draw)];
  for (const each of [outer, root]) sizes.observe(each);
  asked.observe(root, { attributeFilter: ["data-shown"] });
  for (const each of [sizes, asked]) end.addEventListener("abort", () => each.disconnect());
  return { zoom: (/** @type {number|null} */ factor) => zoom.by(store.known.position, factor) };
}

/** The unit of a plot.
 *
 * @param {Plot} plot
 * @param {string} own Unit of the experiment's errors.
 */
function unitOf({ kind, unit }, own) {
  if (kind === "frequency") return "%";
  return kind === "error" || kind === "sigma" ? own : unit;
}

/**
 * @param {HTMLElement} place
 * @param {SessionPublic} session
 */
function explainTitles(place, { plots: all, recipe: { experiment } }) {
  for (const { id, description: own } of all) {
    const heading = place.querySelector(`[data-panel="${CSS.escape(id)}"] h3`);
    if (heading instanceof HTMLElement && heading.textContent) explain(heading, { own, experiment });
  }
}

/** The present plot, with a line at the shown frame.
 *
 * @param {Drawn} drawn
 * @param {Store} store
 * @param {{frames: Frames, isSparkline: boolean, isRoomy: boolean}} look A sparkline has no axes.
 * @param {number} row
 * @returns {Panel}
 */
function panelOf({ plot, rows = 1, show }, store, { frames: [low, high], isSparkline, isRoomy }, row) {
  const { playing, position } = store.known;
  const { traces, y, handles = [], words = "" } = show(store, isRoomy);
  const cursor = lineOver({ name: "position", ink: "muted", width: 1, x: [position, position], y: [y.low, y.high] });
  // For samplers the key has this text.
  const title = plot.kind === "samplers" ? "" : `${plot.title} ${plot.unit}`.trim();
  return {
    id: plot.id,
    title: isTruthMissing(plot, store) ? `${title}: no truth known` : title,
    words: playing ? plot.description : `${plot.description} ${inFrame(traces, position)} ${words}`,
    x: plainAxis({ low, high, hidden: isSparkline }),
    y: plainAxis({ ...y, hidden: isSparkline }),
    traces: [...traces, cursor],
    handles: store.isReadOnly ? [] : handles,
    row: isSparkline ? 0 : row,
    // As high as its rows need, or twice as wide as its neighbour.
    share: [rows > 1 && !isSparkline ? (BESIDE_PX + ROW_PX * rows) / PLOT_PX : 1, rows > 1 && isSparkline ? 2 : 1],
  };
}

/** The plots that are unfolded at first: the error, if the truth is known, and the experiment's first plots.
 *
 * @param {Drawn[]} all
 * @param {Store} store
 */
function firstOf(all, store) {
  const known = all.filter(({ plot }) => !isTruthMissing(plot, store));
  const first = [...new Set([...known.filter(({ plot }) => plot.kind === "error"), ...known])].slice(0, 2);
  return all.filter((each) => first.includes(each));
}

/** Whether any branch has data for a plot: plots without data are hidden.
 *
 * @param {Drawn} drawn
 * @param {Store} store
 */
function isMeasured({ needs, plot }, store) {
  if (needs === undefined || store.history.length === 0 || isTruthMissing(plot, store)) return true;
  return store.branches.some(({ id }) => needs.some((name) => store.historyOf(id).measures(name)));
}

/** Whether there is nothing to draw because the truth is unknown.
 *
 * @param {Plot} plot
 * @param {Store} store
 */
function isTruthMissing({ needs_truth: needsTruth }, { history }) {
  return needsTruth && history.length > 0 && !history.some((row) => curve.error(row) !== null);
}

/** The values of the lines in a frame; with several branches, those of the active one.
 *
 * @param {Trace[]} traces
 * @param {number} frame
 */
function inFrame(traces, frame) {
  const lines = traces.filter((trace) => trace.kind === "line").filter(({ x, y, said }) => said !== "" && x[frame] === frame && Number.isFinite(y[frame]));
  const values = [...new Map(lines.map((each) => [each.said, told(each, frame)])).values()];
  return values.length > 0 ? `In frame ${frame} ${values.join(", ")}.` : "";
}
