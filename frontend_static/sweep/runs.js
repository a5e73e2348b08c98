/** The runs of the chosen cell, failures first; each is a link to the run itself, with its other methods beside it. */

import { messageOf } from "../shared/api.js";
import { fill, h } from "../shared/dom.js";
import { count } from "../shared/format.js";
import { later } from "../shared/timing.js";
import { linkToReferences } from "../shared/comparison_link.js";
import { runPage, sweeps } from "./api.js";
import { placeOf } from "./cell_text.js";
import { select } from "./choices.js";
import { short } from "./cell_style.js";

/** @import { CellsPublic, RowPublic, RowsPublic, SweepPublic } from "../shared/messages.js" */
/** @import { Chosen, SweepStore } from "./store.js" */

const PAGE = 50;
const MOST_BESIDE = 3;
const ALL = "";
const SKELETON_AFTER_MS = 200;
const NEW_TAB = { target: "_blank", rel: "noreferrer" };

export class RunList {
  #root;
  #store;
  /** Ends what was asked for before: only the newest question is answered. */
  #outdated = new AbortController();
  #tracker = ALL;
  /** The axes of the map that cells are chosen in. */
  #axes = "";

  /**
   * @param {HTMLElement} root
   * @param {SweepStore} store
   */
  constructor(root, store) {
    this.#root = root;
    this.#store = store;
    this.#invite();
    store.on(["chosen"], () => {
      this.#tracker = store.chosen?.tracker ?? ALL;
      this.#load();
    });
    store.on(["view"], () => this.#look());
  }

  /** Another map has other cells. */
  #look() {
    const { x, y } = this.#store.view;
    if (this.#axes === `${x} ${y}`) return;
    this.#axes = `${x} ${y}`;
    this.#store.chosen = null;
    this.#invite();
  }

  #invite() {
    this.#outdated.abort();
    const words = "Choose a cell of a map, and its runs are listed here, failures first. A run opens in a new tab, shortly before it lost the target.";
    fill(this.#root, h("h2", {}, "Runs"), h("p", { class: "hint" }, words));
  }

  async #load() {
    const { chosen, cells } = this.#store;
    if (chosen === null || cells === null) return;
    this.#outdated.abort();
    this.#outdated = new AbortController();
    const { signal } = this.#outdated;
    const heading = () => this.#heading(cells, chosen);
    const skeleton = () => fill(this.#root, heading(), h("div", { class: "bone shimmer" }), h("div", { class: "bone short shimmer" }));
    const stop = later(skeleton, SKELETON_AFTER_MS, signal);
    try {
      const found = await this.#ask(chosen, 0);
      if (!signal.aborted) fill(this.#root, heading(), this.#list(found, chosen));
    } catch (error) {
      const again = h("button", { type: "button", on: { click: () => this.#load() } }, "Try again");
      if (!signal.aborted) fill(this.#root, heading(), h("p", { class: "wrong", role: "alert" }, messageOf(error)), again);
    } finally {
      stop();
    }
  }

  /**
   * @param {Chosen} chosen
   * @param {number} offset
   */
  #ask({ i, j }, offset) {
    const { view, known } = this.#store;
    return sweeps.rows(known.id, { x: view.x, y: view.y, i, j, offset, limit: PAGE, ...(this.#tracker !== ALL && { tracker: this.#tracker }) });
  }

  /**
   * @param {CellsPublic} cells
   * @param {Chosen} chosen
   */
  #heading({ x, y }, { i, j }) {
    const methods = this.#store.known.trackers.map(({ id, title }) => ({ value: id, words: title }));
    const choose = (/** @type {string} */ tracker) => {
      this.#tracker = tracker;
      this.#load();
    };
    return h(
      "header",
      { class: "runs-head" },
      h("h2", {}, placeOf(x, i), y && [h("br"), placeOf(y, j)]),
      methods.length > 1 && select("Tracker", [{ value: ALL, words: "All trackers" }, ...methods], this.#tracker, choose),
    );
  }

  /**
   * The first runs of a cell, and a button for more.
   *
   * @param {RowsPublic} found
   * @param {Chosen} chosen
   */
  #list({ total, failures, rows }, chosen) {
    const list = h("ol", { class: "runs" }, rows.map((row) => item(this.#store, row)));
    const more = h("button", { type: "button", hidden: rows.length >= total }, "Show more");
    more.addEventListener("click", async () => {
      more.disabled = true;
      const next = await this.#ask(chosen, list.children.length).catch(() => null);
      more.disabled = false;
      if (next === null) return;
      list.append(...next.rows.map((row) => item(this.#store, row)));
      more.hidden = next.rows.length === 0 || list.children.length >= next.total;
    });
    return [h("p", { class: "hint" }, summary(this.#store.known, total, failures)), list, more];
  }
}

/**
 * @param {SweepPublic} sweep
 * @param {number} total
 * @param {number} failures
 */
function summary({ state, judged }, total, failures) {
  if (total === 0) return state === "running" ? "No run of this cell has been computed yet." : "No run of this cell was computed.";
  return judged ? `${failures} of ${count(total, "run")} failed` : count(total, "run");
}

/**
 * @param {SweepStore} store
 * @param {RowPublic} row
 */
function item(store, row) {
  const { known: sweep } = store;
  const verdict = verdictOf(row);
  const open = row.problem === null;
  const title = [h("span", { class: "run-method" }, store.titleOf(row.tracker)), h("span", {}, `trial ${row.trial}`)];
  return h(
    "li",
    { class: "run", data: { run: row.run, verdict } },
    h(
      "div",
      { class: "run-line" },
      open ? h("a", { class: "run-title", href: runPage(sweep.id, row.run), ...NEW_TAB }, title) : h("span", { class: "run-title" }, title),
      h("span", { class: `run-verdict ${verdict}` }, verdict),
    ),
    h("p", { class: "hint" }, row.problem ?? facts(sweep, row)),
    h("p", { class: "hint" }, [...pooled(store, row), `seed ${row.seed}`].join(", ")),
    open && sweep.trackers.length > 1 && others(store, row),
  );
}

/** @param {RowPublic} row */
function verdictOf({ problem, success }) {
  if (problem !== null) return "not possible";
  if (success === null) return "";
  return success ? "success" : "failure";
}

/**
 * The values of a run on the axes that are not seen.
 *
 * @param {SweepStore} store
 * @param {RowPublic} row
 */
function pooled({ known, view }, { conditions }) {
  const hidden = known.axes.filter(({ name }) => name !== view.x && name !== view.y);
  return hidden.map(({ name, title, unit }) => `${title.toLowerCase()} ${conditions[name]}${unit ? ` ${unit}` : ""}`);
}

/**
 * Links to the same run by the other methods.
 *
 * @param {SweepStore} store
 * @param {RowPublic} row
 */
function others(store, row) {
  const { known: sweep } = store;
  const methods = sweep.trackers.filter(({ id }) => id !== row.tracker);
  return h(
    "p",
    { class: "run-others" },
    h("span", { class: "hint" }, "Same seed"),
    h("a", { class: "chip-link", title: compareTitle(store, row, methods), href: comparison(sweep, row, methods), ...NEW_TAB }, "Compare"),
    methods.map(({ id }) => {
      const title = `The same seed with ${store.titleOf(id)}`;
      return h("a", { class: "chip-link", title, href: runPage(sweep.id, row.run, id), ...NEW_TAB }, store.shortOf(id));
    }),
  );
}

/**
 * Where this run stands beside the same seed by other methods.
 *
 * @param {SweepPublic} sweep
 * @param {RowPublic} row
 * @param {{id: string}[]} methods
 */
function comparison({ id }, { run }, methods) {
  return linkToReferences([`${id}:${run}`, ...methods.slice(0, MOST_BESIDE).map((method) => `${id}:${run}:${method.id}`)]);
}

/**
 * @param {SweepStore} store
 * @param {RowPublic} row
 * @param {{id: string}[]} methods
 */
function compareTitle(store, { tracker }, methods) {
  return `The same seed with ${[tracker, ...methods.slice(0, MOST_BESIDE).map(({ id }) => id)].map((id) => store.titleOf(id)).join(", ")}, in step`;
}

/**
 * @param {SweepPublic} sweep
 * @param {RowPublic} row
 */
function facts(sweep, row) {
  // The unit stays with its number.
  const unit = sweep.unit ? `\u00a0${sweep.unit}` : "";
  const error = row.mean_error === null ? "" : `error ${short(row.mean_error)}${unit}`;
  if (row.lost_frames === null) return error;
  if (row.lost_frames === 0) return `never lost, ${error}`;
  return `lost in ${count(row.lost_frames, "frame")}, first in frame ${row.first_lost_frame}, ${error}`;
}
