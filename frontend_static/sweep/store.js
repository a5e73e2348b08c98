/**
 * What the page knows of its sweep, and what a person has chosen to see of it.
 *
 * The server decides what is so; this is its latest word. Views subscribe to topics: `sweep` (how far it is), `cells`
 * (the maps), `view` (what is shown of them), `comparison`, `chosen` (the cell whose runs are listed), `connection`.
 */

import { throttle } from "../shared/timing.js";
import { Topics } from "../shared/topics.js";
import { sweeps } from "./api.js";

const COMPARE_EVERY_MS = 1000;
/** @type {Exclude<keyof MapPublic, "tracker"|"measures">[]} */
const COLUMNS = ["runs", "problems", "successes", "rate", "low", "high", "error", "lost_frames"];
export const NO_AXIS = "none";

/** @import { Cells, CellsPublic, ComparisonPublic, MapPublic, SweepMessage, SweepPublic } from "../shared/messages.js" */
/** @import { View } from "./view.js" */

/** @typedef {"sweep"|"cells"|"view"|"comparison"|"chosen"|"connection"} Topic */

/** @typedef {{i: number, j: number, tracker: string|null}} Chosen A cell by its places on the axes, and the method of its map. */

/** @extends {Topics<Topic>} */
export class SweepStore extends Topics {
  /** @type {SweepPublic|null} */
  sweep = null;
  /** @type {CellsPublic|null} */
  cells = null;
  /** @type {ComparisonPublic|null} */
  comparison = null;
  /** @type {Chosen|null} */
  chosen = null;
  /** @type {"connecting"|"open"|"lost"|"gone"} */
  connection = "connecting";
  view;

  /** @param {View} view */
  constructor(view) {
    super();
    this.view = view;
  }

  /** The sweep, where there must be one: who listens to what changes in it is only called then. */
  get known() {
    if (this.sweep === null) throw new Error("The sweep has not been loaded yet");
    return this.sweep;
  }

  /**
   * Take over the sweep as the server describes it, before the stream brings more.
   *
   * @param {SweepPublic} sweep
   */
  begin(sweep) {
    this.sweep = sweep;
    this.#complete();
    this.tell("sweep", "view");
  }

  /**
   * Take over how far it is.
   *
   * @param {SweepPublic} sweep
   */
  take(sweep) {
    this.sweep = sweep;
    this.tell("sweep", "cells");
  }

  /**
   * Take over a message of the stream.
   *
   * @param {SweepMessage} message
   */
  receive(message) {
    if (message.type === "hello") {
      this.connection = "open";
      this.sweep = message.sweep;
      this.cells = message.cells;
      this.tell("connection", "sweep", "cells");
      this.compare();
    } else if (message.type === "progress") {
      this.take(message.sweep);
    } else if (message.type === "cells" && this.cells !== null) {
      this.#merge(message);
      this.tell("cells");
      this.compare();
    }
  }

  /**
   * Change what is shown.
   *
   * @param {Partial<View>} changes
   */
  show(changes) {
    Object.assign(this.view, changes);
    if (this.view.first === this.view.second) {
      const other = this.known.trackers.find(({ id }) => id !== this.view.first);
      if ("first" in changes) this.view.second = other?.id ?? this.view.second;
      else this.view.first = other?.id ?? this.view.first;
    }
    this.comparison = null;
    this.tell("view");
    this.compare();
  }

  /**
   * List the runs of a cell.
   *
   * @param {Chosen} cell
   */
  choose(cell) {
    this.chosen = cell;
    this.tell("chosen");
  }

  /** @param {SweepStore["connection"]} connection */
  setConnection(connection) {
    this.connection = connection;
    this.tell("connection");
  }

  /** What is shown of single methods, or what two are compared by. */
  get quantity() {
    if (this.measure !== undefined) return "measure";
    return this.view.show === "error" || (this.compares && this.view.measure === "error") ? "error" : "success";
  }

  /** The measure that is shown, or by which two methods are compared, if one is. */
  get measure() {
    const { show, of, measure } = this.view;
    const shown = show === "measure" ? of : this.compares && measure;
    return this.known.measures.find(({ name }) => name === shown);
  }

  /** Whether the maps show one method against another. */
  get compares() {
    return ["difference", "significance"].includes(this.view.show) && this.sweep !== null && this.sweep.trackers.length > 1;
  }

  compare = throttle(() => this.#compare(), COMPARE_EVERY_MS);

  /**
   * "h-SPF" of "Hard switching (h-SPF)".
   *
   * @param {string} tracker
   */
  shortOf(tracker) {
    const title = this.titleOf(tracker);
    return /\(([^)]+)\)$/.exec(title)?.[1] ?? title;
  }

  /** @param {string} tracker */
  titleOf(tracker) {
    return this.known.trackers.find(({ id }) => id === tracker)?.title ?? tracker;
  }

  async #compare() {
    if (!this.compares) return;
    const { x, y, first, second, measure, level, correction, test } = this.view;
    const asked = JSON.stringify([x, y, first, second, measure, level, correction, test]);
    try {
      const { comparison } = await sweeps.cells(this.known.id, { x, y, first, second, measure, level, correction, test });
      const now = this.view;
      if (asked !== JSON.stringify([now.x, now.y, now.first, now.second, now.measure, now.level, now.correction, now.test])) return;
      this.comparison = comparison;
      this.tell("comparison");
    } catch {
      // The next change of the cells asks again.
    }
  }

  /** Fill in what the address left open. */
  #complete() {
    const { axes, trackers } = this.known;
    const view = this.view;
    const known = (/** @type {string} */ name) => axes.some((axis) => axis.name === name);
    if (!known(view.x)) view.x = axes[0]?.name ?? NO_AXIS;
    if (!known(view.y) || view.y === view.x) view.y = axes.find(({ name }) => name !== view.x)?.name ?? NO_AXIS;
    const ids = trackers.map(({ id }) => id);
    if (!ids.includes(view.first)) view.first = ids[0];
    if (!ids.includes(view.second) || view.second === view.first) view.second = ids.find((id) => id !== view.first) ?? ids[0];
    this.#completeMeasure();
    this.#completeShow();
  }

  /** Show nothing that there is not: without truth there are neither success nor error. */
  #completeShow() {
    const { view, known } = this;
    /** @type {import("./view.js").View["show"][]} */
    const open = [];
    if (known.judged) open.push("success");
    if (known.has_truth) open.push("error");
    if (known.measures.length > 0) open.push("measure");
    if (known.trackers.length > 1) open.push("difference", "significance");
    if (!open.includes(view.show)) view.show = open[0];
  }

  #completeMeasure() {
    const { view, known } = this;
    if (!known.measures.some(({ name }) => name === view.of)) view.of = known.measures[0]?.name ?? "";
    const names = [...(known.judged ? ["success"] : []), ...(known.has_truth ? ["error"] : []), ...known.measures.map(({ name }) => name)];
    if (!names.includes(view.measure)) view.measure = names[0];
  }

  /** @param {Cells} message */
  #merge({ at, maps, done }) {
    const { cells } = this;
    if (cells === null) return;
    cells.done = done;
    for (const changed of maps) {
      const map = cells.maps.find(({ tracker }) => tracker === changed.tracker);
      if (!map) continue;
      for (const name of COLUMNS) at.forEach((index, place) => (map[name][index] = changed[name][place]));
      for (const [name, column] of Object.entries(changed.measures)) at.forEach((index, place) => (map.measures[name][index] = column[place]));
    }
  }
}
