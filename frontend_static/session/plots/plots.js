/**
 * The live plots: what the experiment declares, panels of one figure over one axis of frames. Where their place says
 * `data-shown="first"`, and in a presentation, two are seen: the error and the first other one. The axis can be looked at more
 * closely (`Zoom`).
 */

import { sendCommand } from "../../shared/api.js";
import { attempt, build } from "../../shared/dom.js";
import { plainAxis } from "../../shared/figure/axes.js";
import { FigureView } from "../../shared/figure/figure.js";
import { lineOver, told } from "../../shared/figure/kinds.js";
import { explain } from "../../shared/terms.js";
import { follow, throttle, until } from "../../shared/timing.js";
import { samplers } from "../readings.js";
import { curve } from "../store.js";
import { KINDS } from "./kinds.js";

/** @import { Panel, Spans, Trace } from "../../shared/figure/traces.js" */
/** @import { Plot } from "../../shared/messages.js" */
/** @import { View } from "../mount.js" */
/** @import { Curve, History, Row, Store } from "../store.js" */
/** @import { Kind } from "./kinds.js" */

// The numbers of a history in columns, what else is found in it, and the limits of axes that follow from them.

const STEPS = [1, 1.5, 2, 3, 4, 5, 7.5, 10];

/** @type {WeakMap<History, Map<Curve, {edition: number, values: number[]}>>} */
const columns = new WeakMap();

/**
 * A number of all frames, NaN where it is not known. Of a history that has only grown the new frames alone are read.
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

/**
 * What `make` finds in a history, found anew only when that has changed.
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

/**
 * Shades of the intervals in which something held, with a word for them in the key where there are any.
 *
 * @param {string} ink
 * @param {number} opacity
 * @param {(row: Row, place: number) => boolean} test Of a frame and, where there are rows, one of them.
 * @param {{word?: string, rows?: number}} [options] How many rows are shaded apart.
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

/**
 * The smallest and the largest of all; the wrong way round where there is nothing.
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

/**
 * From 0 to beyond a value, rounded, so that it changes seldom and nothing jumps.
 *
 * @param {number} most
 */
export function reach(most) {
  const value = most * 1.05;
  const power = 10 ** Math.floor(Math.log10(value));
  return power * (STEPS.find((step) => step * power >= value) ?? value / power);
}

/**
 * Around values that may lie far from 0, rounded.
 *
 * @param {[number, number]} extent The smallest and the largest value.
 * @param {number} smallest How far they are apart at least.
 * @returns {{low: number, high: number}}
 */
export function enclose([low, high], smallest) {
  if (low > high) return { low: 0, high: smallest };
  const span = Math.max(high - low, smallest);
  const step = 10 ** Math.floor(Math.log10(span / 2));
  const start = Math.floor(low / step) * step;
  return { low: start, high: Math.max(Math.ceil(high / step) * step, start + smallest) };
}

// Which frames the plots of a session show: all, or those that somebody looks at more closely. The wheel with Ctrl, or two
// fingers on a touchpad, zoom at the pointer; dragging moves what is zoomed; a double click shows all again. The keys +, - and
// 0 of the session do the same at the frame that is shown (`keys.js`).

/** @typedef {[low: number, high: number]} Frames */

/**
 * What is to be known of the plots.
 *
 * @typedef {object} Plotted
 * @property {(event: MouseEvent) => {x: number, perPx: number}|null} at Which frame lies under the pointer, and how many in a px.
 * @property {() => number} position Of the frame that is shown.
 * @property {() => void} changed Is called after each change.
 */

/** So much nearer for so many px of the wheel. */
const RATE = 1 / 300;
/** So few frames are never widened further. */
const FEWEST = 4;
const MOVED_PX = 4;

class Zoom {
  #plotted;
  /** @type {Frames|null} */
  #window = null;
  #last = 1;
  /** Whether the pointer that went down last has moved the window. */
  #isMoved = false;

  /**
   * @param {HTMLElement} place Has the plots in it.
   * @param {Plotted} plotted
   * @param {AbortSignal} signal
   */
  constructor(place, plotted, signal) {
    this.#plotted = plotted;
    place.addEventListener("wheel", (event) => this.#wheel(event), { passive: false, signal });
    place.addEventListener("dblclick", () => this.#set(null), { signal });
    place.addEventListener("pointerdown", (event) => this.#drag(event), { signal });
    place.addEventListener("click", (event) => this.#click(event), { capture: true, signal });
  }

  /**
   * The frames that are seen.
   *
   * @param {number} last Number of the last frame.
   * @returns {Frames}
   */
  within(last) {
    this.#last = last;
    if (this.#window !== null && this.#window[1] > last) this.#window = clamped(this.#window, last);
    return this.#window ?? [0, last];
  }

  /** @param {WheelEvent} event */
  #wheel(event) {
    const found = event.ctrlKey || event.metaKey ? this.#plotted.at(event) : null;
    if (found === null) return;
    event.preventDefault();
    this.#set(scaled(this.within(this.#last), found.x, Math.exp(event.deltaY * RATE)));
  }

  /** @param {number|null} factor Above 1 to see more frames around the one that is shown; null for all. */
  by(factor) {
    this.#set(factor === null ? null : scaled(this.within(this.#last), this.#plotted.position(), factor));
  }

  /** @param {MouseEvent} event */
  #click(event) {
    // What was dragged was not chosen.
    if (this.#isMoved) event.stopImmediatePropagation();
    this.#isMoved = false;
  }

  /** @param {PointerEvent} begun */
  #drag(begun) {
    this.#isMoved = false;
    const [window, held] = [this.#window, this.#plotted.at(begun)];
    if (window === null || held === null || begun.button !== 0 || begun.pointerType === "touch") return;
    const end = new AbortController();
    const move = (/** @type {PointerEvent} */ event) => {
      const px = event.clientX - begun.clientX;
      this.#isMoved ||= Math.abs(px) >= MOVED_PX;
      if (this.#isMoved) this.#set([window[0] - px * held.perPx, window[1] - px * held.perPx]);
    };
    document.addEventListener("pointermove", move, { signal: end.signal });
    for (const type of /** @type {const} */ (["pointerup", "pointercancel"])) document.addEventListener(type, () => end.abort(), { signal: end.signal });
  }

  /** @param {Frames|null} window */
  #set(window) {
    this.#window = window && clamped(window, this.#last);
    this.#plotted.changed();
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

/**
 * The nearest window within the frames that there are; null if it has all.
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

/** @typedef {Kind & {plot: Plot, title: string}} Drawn */

const REDRAW_MS = 100;
/** In a narrower session the plots are a row of sparklines. */
const WIDE_PX = 1000;
/** From this width on the plots have room for names that are written out. */
const ROOMY_PX = 350;
/** What is drawn of a session, beside its histories. */
const DRAWN = /** @type {const} */ (["branch", "doubts", "parameters", "position", "playing", "thresholds", "tracker"]);
/** Of the numbers at the axes, in the size of the page's letters. */
const LETTERS = 11 / 16;
/** Heights, px: of a plot, and of one with rows what it has for these and for each. */
const [PLOT_PX, BESIDE_PX, ROW_PX] = [66, 52, 15];

/**
 * @param {HTMLElement} root
 * @param {View} view
 */
export async function plots(root, view) {
  // It is known then what there is to plot.
  await until(() => view.store.session?.plots.length, view.signal);
  return new Plots(root, view);
}

class Plots {
  #root;
  #view;
  #all;
  #figure;
  #zoom;
  /** How many hypotheses there are to choose from. */
  #most = 1;
  /** Each plot in words, for screen readers: of the frame in which the run last stood.
   *
   * @type {Map<string, string>} */
  #words = new Map();
  #place = build("div", { class: "plots-figure", role: "group", "aria-label": "Plots" });
  /** Its width decides whether there is room for axes. */
  #outer;

  /**
   * @param {HTMLElement} root
   * @param {View} view
   */
  constructor(root, view) {
    const { store, signal } = view;
    const session = store.known;
    this.#root = root;
    this.#view = view;
    this.#outer = root.closest(".session-view, .comparison") ?? root;
    this.#all = session.plots
      .filter(({ id }) => view.plots.length === 0 || view.plots.includes(id))
      .map((plot) => ({ plot, title: titleOf(plot, session.unit), ...KINDS[plot.kind](plot, session) }));
    root.append(build("h2", { class: "visually-hidden" }, "Plots"), this.#place);
    const draw = throttle(() => this.#draw(), REDRAW_MS, signal);
    const on = {
      turn: (/** @type {string} */ parameter, /** @type {number} */ value) =>
        attempt(() => sendCommand(session.id, { kind: "change", values: { [parameter]: value } })),
      declared: () => ({ title: "hypothesis that is shown", unit: "", minimum: 1, maximum: this.#most, step: 1 }),
    };
    const inks = samplers(session).map(({ colour }) => colour);
    this.#figure = new FigureView(this.#place, on, signal, { isCompact: true, letters: LETTERS, inks });
    this.#zoom = new Zoom(this.#place, { at: (event) => this.#figure.valuesAt(event), position: () => store.known.position, changed: draw }, signal);
    this.#place.addEventListener("click", (event) => this.#choose(event));
    follow(() => [store.connection, store.ensemble.value, store.lengths, DRAWN.map((name) => store.known[name])], draw, signal);
    document.addEventListener("visibilitychange", draw, { signal });
    const [sizes, asked] = [new ResizeObserver(draw), new MutationObserver(draw)];
    for (const each of [this.#outer, root, this.#place]) sizes.observe(each);
    asked.observe(root, { attributeFilter: ["data-shown"] });
    signal.addEventListener("abort", () => {
      sizes.disconnect();
      asked.disconnect();
    });
  }

  /** @param {number|null} factor Above 1 to see more frames around the one that is shown; null for all. */
  zoom(factor) {
    this.#zoom.by(factor);
  }

  #draw() {
    if (document.hidden) return;
    const { store, able } = this.#view;
    const measured = this.#all.filter((each) => isMeasured(each, store));
    const isFolded = this.#root.dataset.shown === "first" || "presenting" in document.documentElement.dataset;
    const shown = isFolded ? firstOf(measured, store) : measured;
    const isSparkline = this.#outer.clientWidth < WIDE_PX;
    this.#root.classList.toggle("sparklines", isSparkline);
    this.#figure.show({ panels: shown.map((each, row) => this.#panel(each, isSparkline, row)) }, { locked: !able });
    for (const { plot } of shown) {
      const heading = this.#place.querySelector(`[data-panel="${CSS.escape(plot.id)}"] h3`);
      if (heading instanceof HTMLElement && heading.textContent) explain(heading, { own: plot.description, experiment: store.known.recipe.experiment });
    }
    // The keyboard scrolls what is a tab stop.
    this.#root.tabIndex = this.#root.scrollHeight > this.#root.clientHeight ? 0 : -1;
  }

  /**
   * A plot as it is now, with a line at the frame that is shown.
   *
   * @param {Drawn} drawn
   * @param {boolean} isSparkline Without axes.
   * @param {number} row
   * @returns {Panel}
   */
  #panel({ plot, title, rows = 1, show }, isSparkline, row) {
    const { store } = this.#view;
    const { frames, playing, position } = store.known;
    const { traces, y, chosen, words = "" } = show(store, this.#root.clientWidth >= ROOMY_PX);
    if (!playing) this.#words.set(plot.id, `${plot.description} ${inFrame(traces, position)} ${words}`);
    if (chosen) this.#most = chosen.most;
    const [low, high] = this.#zoom.within(Math.max(1, frames - 1));
    const cursor = lineOver({ name: "position", ink: "muted", width: 1, x: [position, position], y: [y.low, y.high] });
    return {
      id: plot.id,
      title: isTruthMissing(plot, store) ? `${title}: the truth is not known` : title,
      words: this.#words.get(plot.id) ?? plot.description,
      x: plainAxis({ low, high, hidden: isSparkline }),
      y: plainAxis({ ...y, hidden: isSparkline }),
      traces: [...traces, cursor],
      handles: chosen && !store.isReadOnly ? [{ parameter: chosen.parameter, at: chosen.at, along: "y" }] : [],
      row: isSparkline ? 0 : row,
      // As high as its rows need, or twice as wide as what is beside it.
      share: [rows > 1 && !isSparkline ? (BESIDE_PX + ROW_PX * rows) / PLOT_PX : 1, rows > 1 && isSparkline ? 2 : 1],
    };
  }

  /**
   * Choose what is clicked, in a plot where that has a meaning.
   *
   * @param {MouseEvent} event
   */
  #choose(event) {
    const at = this.#view.store.isReadOnly ? null : this.#figure.valuesAt(event);
    if (at !== null) this.#all.find(({ plot }) => plot.id === at.panel)?.choose?.(this.#view, Math.round(at.x), at.y);
  }
}

/**
 * @param {Plot} plot
 * @param {string} own Unit of the experiment's errors.
 */
function titleOf({ kind, title, unit }, own) {
  /** @type {Record<string, string>} */
  const units = { error: own, sigma: own, frequency: "%" };
  // Of samplers the key says it.
  return kind === "samplers" ? "" : `${title} ${units[kind] ?? unit}`.trim();
}

/**
 * What is seen before somebody asks for more: the error, where the truth is known, and what the experiment declares first.
 *
 * @param {Drawn[]} all
 * @param {Store} store
 */
function firstOf(all, store) {
  const known = all.filter(({ plot }) => !isTruthMissing(plot, store));
  const isError = (/** @type {Drawn} */ { plot }) => plot.kind === "error";
  const first = [...known.filter(isError), ...known.filter((each) => !isError(each))].slice(0, 2);
  return all.filter((each) => first.includes(each));
}

/**
 * Whether any branch has something to draw: what a method does not have is not drawn.
 *
 * @param {Drawn} drawn
 * @param {Store} store
 */
function isMeasured({ needs, plot }, store) {
  if (needs === undefined || store.history.length === 0 || isTruthMissing(plot, store)) return true;
  return store.branches.some(({ id }) => needs.some((name) => store.historyOf(id).measures(name)));
}

/**
 * Whether there is nothing to draw because nobody knows the truth.
 *
 * @param {Plot} plot
 * @param {Store} store
 */
function isTruthMissing({ needs_truth: needsTruth }, { history }) {
  return needsTruth && history.length > 0 && history.most(curve.error) === null;
}

/**
 * What the lines say in a frame; of several branches the active one's.
 *
 * @param {Trace[]} traces
 * @param {number} frame
 */
function inFrame(traces, frame) {
  const lines = traces.filter((trace) => trace.kind === "line").filter(({ x, y, said }) => said !== "" && x[frame] === frame && Number.isFinite(y[frame]));
  const values = [...new Map(lines.map((each) => [each.said, told(each, frame)])).values()];
  return values.length > 0 ? `In frame ${frame} ${values.join(", ")}.` : "";
}
