/** Small multiples: a heat map a method over shared axes and colours; and one method against another. */

import { fill, h, setText } from "../shared/dom.js";
import { count } from "../shared/format.js";
import { coalesce } from "../shared/timing.js";
import { describe } from "./cell_text.js";
import { comparisonLook, methodLook } from "./cell_style.js";
import { HeatMap } from "./map.js";
import { Tooltip } from "../shared/tooltip.js";

/** @import { CellsPublic, MapPublic } from "../shared/messages.js" */
/** @import { SweepStore } from "./store.js" */

/** @typedef {{map: HeatMap, heading: HTMLElement, value: HTMLOutputElement, element: HTMLElement}} Figure */
/** @typedef {{id: string, tracker: string|null}} Wanted A map by its name, and the method that it is of; null for a comparison. */

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
      figures[place].map.mark(this.#store.chosen);
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
    figure.map.show(`${title}, ${store.measure?.title ?? store.quantity}`, cells, methodLook(store, cells, map));
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
    figure.map.show(`${title}, ${show}`, cells, comparisonLook(store, cells));
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
    const map = new HeatMap({
      point: (cell, place) => store.cells && this.#tip.show(describe(store, store.cells, cell, id), place),
      leave: () => this.#tip.hide(),
      choose: ({ i, j }) => {
        this.#tip.hide();
        store.choose({ i, j, tracker: store.known.trackers.some((tracker) => tracker.id === id) ? id : null });
      },
    });
    return { map, heading, value, element: h("figure", { class: "map", data: { map: id } }, h("figcaption", {}, heading, value), map.element) };
  }
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
function pooled({ known }, map) {
  const sum = (/** @type {(number|null)[]} */ column) => column.reduce((/** @type {number} */ total, value) => total + (value ?? 0), 0);
  const runs = sum(map.runs) - sum(map.problems);
  if (runs === 0) return "";
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
