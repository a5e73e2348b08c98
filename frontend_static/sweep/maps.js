/** Small multiples: a heat map a method over shared axes and colours; and one method against another. */

import { fill, h, setText } from "../shared/dom.js";
import { FigureView } from "../shared/figure/figure.js";
import { count } from "../shared/format.js";
import { coalesce } from "../shared/timing.js";
import { Tooltip } from "../shared/tooltip.js";
import { describe } from "./cell_text.js";
import { comparisonLook, methodLook } from "./cell_style.js";

/** @import { Axis, CellLook } from "../shared/figure/traces.js" */
/** @import { Value } from "../shared/format.js" */
/** @import { AxisPublic, CellsPublic, MapPublic } from "../shared/messages.js" */
/** @import { SweepStore } from "./store.js" */

/** @typedef {(title: string, cells: CellsPublic, look: (index: number) => CellLook) => void} Show */
/** @typedef {{show: Show, heading: HTMLElement, value: HTMLOutputElement, element: HTMLElement}} Figure */
/** @typedef {{id: string, tracker: string|null}} Wanted A map by its name, and the method that it is of; null for a comparison. */

const KEYS = "Arrow keys move from cell to cell, Enter lists its runs.";
const PANEL = "map";
/** The maps last as long as their page. */
const FOREVER = new AbortController().signal;

export class Maps {
  #root;
  #store;
  /** @type {Map<string, Figure>} */
  #figures = new Map();
  #tip = new Tooltip();
  #shown = "";

  /**
   * @param {HTMLElement} root
   * @param {SweepStore} store
   */
  constructor(root, store) {
    this.#root = root;
    this.#store = store;
    document.body.append(this.#tip.element);
    store.on(["sweep", "cells", "view", "comparison", "chosen"], coalesce(() => this.#draw()));
    addEventListener("scroll", () => this.#tip.hide(), { passive: true });
  }

  #draw() {
    const { cells } = this.#store;
    if (cells === null) return;
    const wanted = this.#wanted();
    const figures = wanted.map(({ id }) => this.#figure(id));
    const ids = wanted.map(({ id }) => id).join(" ");
    if (ids !== this.#shown) {
      this.#shown = ids;
      fill(this.#root, figures.map(({ element }) => element));
      this.#root.dataset.count = String(figures.length);
    }
    wanted.forEach(({ tracker }, place) => {
      const map = cells.maps.find((one) => one.tracker === tracker);
      if (map) this.#drawMethod(figures[place], cells, map);
      else if (tracker === null) this.#drawComparison(figures[place], cells);
    });
  }

  /**
   * What is to be drawn: a method each, or two methods and their difference.
   *
   * @returns {Wanted[]}
   */
  #wanted() {
    const { view, known, compares } = this.#store;
    const { first, second, show } = view;
    if (!compares) return known.trackers.map(({ id }) => ({ id, tracker: id }));
    return [{ id: first, tracker: first }, { id: second, tracker: second }, { id: `${show} of ${first} and ${second}`, tracker: null }];
  }

  /**
   * @param {Figure} figure
   * @param {CellsPublic} cells
   * @param {MapPublic} map
   */
  #drawMethod(figure, cells, map) {
    const store = this.#store;
    const title = named(store, map.tracker);
    label(figure, title, pooled(store, map));
    figure.show(`${title}, ${store.measure?.title ?? store.quantity}`, cells, methodLook(store, cells, map));
  }

  /**
   * @param {Figure} figure
   * @param {CellsPublic} cells
   */
  #drawComparison(figure, cells) {
    const store = this.#store;
    const { first, second, show } = store.view;
    const title = `${store.shortOf(first)} against ${store.shortOf(second)}`;
    label(figure, title, verdicts(store));
    figure.show(`${title}, ${show}`, cells, comparisonLook(store, cells));
  }

  /** @param {string} id */
  #figure(id) {
    const figure = this.#figures.get(id) ?? this.#make(id);
    this.#figures.set(id, figure);
    return figure;
  }

  /**
   * @param {string} id
   * @returns {Figure}
   */
  #make(id) {
    const store = this.#store;
    const heading = h("span", {});
    const value = h("output", {});
    const room = h("div", { class: "map-room" });
    const figure = new FigureView(
      room,
      {
        describe: (_, cell) => store.cells && describe(store, store.cells, cell, id),
        choose: (_, { i, j }) => store.choose({ i, j, tracker: store.known.trackers.some((tracker) => tracker.id === id) ? id : null }),
      },
      FOREVER,
      { isCompact: true, tip: this.#tip },
    );
    const show = (/** @type {string} */ title, /** @type {CellsPublic} */ { x, y }, /** @type {(index: number) => CellLook} */ look) => {
      const [across, up] = [axisOf(x), axisOf(y)];
      const cells = { across: across.names.length, up: up.names.length, look, chosen: store.chosen };
      const trace = { ...cells, kind: /** @type {const} */ ("heat map"), title: /** @type {const} */ (""), ink: "", name: id };
      const words = `${title}. ${KEYS}`;
      const panel = { id: PANEL, title: "", x: across, y: up, traces: [trace], handles: [], words, row: 0, share: /** @type {[number, number]} */ ([1, 1]) };
      setLengths(room, { across: cells.across, up: cells.up });
      // Read whenever it is drawn: the style sheet decides, which gives the room its height by it.
      const sized = { ...panel, get unit_px() { return parseFloat(getComputedStyle(room).getPropertyValue("--widest")); } };
      figure.show({ panels: [sized] }, { locked: true });
      const around = figure.around(PANEL);
      if (around !== null) setLengths(room, { beside: `${around.across}px`, under: `${around.up}px` });
    };
    const element = h("figure", { class: "map", data: { map: id } }, h("figcaption", {}, heading, value), h("div", { class: "map-plot" }, room));
    return { show, heading, value, element };
  }
}

/**
 * Tell the style sheet of what a map's height follows.
 *
 * @param {HTMLElement} room
 * @param {Record<string, number|string>} lengths
 */
function setLengths(room, lengths) {
  for (const [name, length] of Object.entries(lengths)) room.style.setProperty(`--${name}`, String(length));
}

/**
 * A cell for each value, in the middle of which it stands.
 *
 * @param {AxisPublic|null} axis
 * @returns {Axis}
 */
function axisOf(axis) {
  const { title, unit, values } = axis ?? { title: "", unit: "", values: [""] };
  return { title, unit, names: values.map(short), low: -0.5, high: values.length - 0.5, log: false, hidden: axis === null };
}

/**
 * A value of an axis, short.
 *
 * @param {Value} value
 */
function short(value) {
  return typeof value === "number" ? String(Number(value.toPrecision(4))) : String(value);
}

/**
 * @param {Figure} figure
 * @param {string} title
 * @param {string} words
 */
function label({ heading, value }, title, words) {
  setText(heading, title);
  heading.title = title;
  setText(value, words);
}

/**
 * "h-SPF · Hard switching": what is cut off in a narrow place is the less important part.
 *
 * @param {SweepStore} store
 * @param {string} tracker
 */
function named(store, tracker) {
  const [whole, brief] = [store.titleOf(tracker), store.shortOf(tracker)];
  return whole === brief ? whole : `${brief} · ${whole.replace(` (${brief})`, "")}`;
}

/**
 * All cells of a method together.
 *
 * @param {SweepStore} store
 * @param {MapPublic} map
 */
function pooled({ known, measure }, map) {
  const sum = (/** @type {(number|null)[]} */ column) => column.reduce((/** @type {number} */ total, value) => total + (value ?? 0), 0);
  const runs = sum(map.runs) - sum(map.problems);
  if (runs === 0) return "";
  // Such as a filter from a file, which says of no loss how probable it is.
  if (measure && map.measures[measure.name].every((value) => value === null)) return `has no number for “${measure.title}”`;
  return known.judged ? `${((100 * sum(map.successes)) / runs).toFixed(0)} % of ${count(runs, "run")} succeeded` : count(runs, "run");
}

/**
 * How many cells each of two methods has for itself.
 *
 * @param {SweepStore} store
 */
function verdicts({ view, comparison }) {
  if (view.show !== "significance" || comparison === null) return "";
  const of = (/** @type {typeof comparison.verdict[number]} */ code) => comparison.verdict.filter((one) => one === code).length;
  const untested = of("untested") > 0 ? `, ${of("untested")} not applicable` : "";
  return `${count(of("first"), "cell")} to ${of("second")}, ${of("none")} not significant${untested}`;
}
