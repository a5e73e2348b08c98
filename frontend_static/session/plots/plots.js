/**
 * The live plots: what the experiment declares, panels of one figure over one axis of frames. Where their place says
 * `data-shown="first"`, and in a presentation, two are seen: the error and the first other one. The axis can be looked at more
 * closely (`zoom.js`).
 */

import { api } from "../../shared/api.js";
import { h } from "../../shared/dom.js";
import { follow, until } from "../../shared/effects.js";
import { plainAxis } from "../../shared/figure/axes.js";
import { FigureView } from "../../shared/figure/figure.js";
import { lineOver, told } from "../../shared/figure/kinds.js";
import { explain } from "../../shared/terms.js";
import { throttle } from "../../shared/timing.js";
import { attempt } from "../../shared/toast.js";
import { curve } from "../history.js";
import { samplers } from "../series.js";
import { KINDS } from "./kinds.js";
import { Zoom } from "./zoom.js";

/** @import { Panel, Trace } from "../../shared/figure/traces.js" */
/** @import { Plot } from "../../shared/messages.js" */
/** @import { View } from "../mount.js" */
/** @import { Store } from "../store.js" */
/** @import { Kind } from "./kinds.js" */

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
  new Plots(root, view);
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
  #place = h("div", { class: "plots-figure", tabindex: 0, role: "group", "aria-label": "Plots" });
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
    root.append(h("h2", { class: "visually-hidden" }, "Plots"), this.#place);
    const draw = throttle(() => this.#draw(), REDRAW_MS, signal);
    const on = {
      turn: (/** @type {string} */ parameter, /** @type {number} */ value) =>
        attempt(() => api.command(session.id, { kind: "change", values: { [parameter]: value } })),
      declared: () => ({ title: "hypothesis that is shown", unit: "", minimum: 1, maximum: this.#most, step: 1 }),
    };
    const inks = samplers(session).map(({ colour }) => colour);
    this.#figure = new FigureView(this.#place, on, signal, { isCompact: true, letters: LETTERS, inks });
    this.#zoom = new Zoom(this.#place, { at: (event) => this.#figure.valuesAt(event), position: () => store.known.position, changed: draw }, signal);
    this.#place.addEventListener("click", (event) => this.#choose(event));
    follow(() => [store.connection, store.ensemble, store.lengths, DRAWN.map((name) => store.known[name])], draw, signal);
    document.addEventListener("visibilitychange", draw, { signal });
    const [sizes, asked] = [new ResizeObserver(draw), new MutationObserver(draw)];
    sizes.observe(this.#outer);
    asked.observe(root, { attributeFilter: ["data-shown"] });
    signal.addEventListener("abort", () => {
      sizes.disconnect();
      asked.disconnect();
    });
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
