/**
 * What the page knows of its sweep, and what a person has chosen to see of it.
 *
 * The server decides what is so; this is its latest word. Views subscribe to topics: `sweep` (how far it is), `cells`
 * (the maps), `view` (what is shown of them), `comparison`, `chosen` (the cell whose runs are listed), `connection`.
 */

import { throttle } from "../shared/timing.js";
import { sweeps } from "./api.js";

const COMPARE_EVERY_MS = 1000;
export const NO_AXIS = "none";

/** @typedef {import("../shared/messages.js").SweepPublic} SweepPublic */

export class SweepStore {
  /** @type {SweepPublic|null} */
  sweep = null;
  /** @type {import("../shared/messages.js").CellsPublic|null} */
  cells = null;
  /** @type {import("../shared/messages.js").ComparisonPublic|null} */
  comparison = null;
  /** @type {{i: number, j: number, tracker?: string}|null} */
  chosen = null;
  /** @type {"connecting"|"open"|"lost"|"gone"} */
  connection = "connecting";
  view;
  /** @type {Map<string, Set<() => void>>} */
  #listeners = new Map();

  constructor(view) {
    this.view = view;
  }

  /** Call `listener` after each change of any of the topics. */
  on(topics, listener) {
    for (const topic of topics.split(" ")) {
      const those = this.#listeners.get(topic) ?? new Set();
      this.#listeners.set(topic, those.add(listener));
    }
  }

  /** The sweep, where there must be one: who listens to what changes in it is only called then. */
  get known() {
    if (this.sweep === null) throw new Error("Nothing is known of the sweep yet");
    return this.sweep;
  }

  /** Take over the sweep as the server describes it, before the stream brings more. */
  begin(sweep) {
    this.sweep = sweep;
    this.#complete();
    this.#tell("sweep", "view");
  }

  /** Take over how far it is. */
  take({ state, message, done, successes, rate, seconds, seconds_left, outcome }) {
    Object.assign(this.known, { state, message, done, successes, rate, seconds, seconds_left, outcome });
    this.#tell("sweep", "cells");
  }

  /** Take over a message of the stream. */
  receive(message) {
    if (message.type === "hello") {
      this.connection = "open";
      this.sweep = message.sweep;
      this.cells = message.cells;
      this.#tell("connection", "sweep", "cells");
      this.compare();
    } else if (message.type === "progress") {
      this.take(message);
    } else if (message.type === "cells" && this.cells !== null) {
      this.#merge(message);
      this.#tell("cells");
      this.compare();
    }
  }

  /** Change what is shown. */
  show(changes) {
    Object.assign(this.view, changes);
    if (this.view.first === this.view.second) {
      const other = this.known.trackers.find(({ id }) => id !== this.view.first);
      if ("first" in changes) this.view.second = other?.id ?? this.view.second;
      else this.view.first = other?.id ?? this.view.first;
    }
    this.comparison = null;
    this.#tell("view");
    this.compare();
  }

  /** List the runs of a cell. */
  choose(cell) {
    this.chosen = cell;
    this.#tell("chosen");
  }

  setConnection(connection) {
    this.connection = connection;
    this.#tell("connection");
  }

  /** Whether the maps show one method against another. */
  get compares() {
    return ["difference", "significance"].includes(this.view.show) && this.sweep !== null && this.sweep.trackers.length > 1;
  }

  compare = throttle(() => this.#compare(), COMPARE_EVERY_MS);

  /** "h-SPF" of "Hard switching (h-SPF)". */
  shortOf(tracker) {
    const title = this.titleOf(tracker);
    return /\(([^)]+)\)$/.exec(title)?.[1] ?? title;
  }

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
      this.#tell("comparison");
    } catch {
      // The next change of the cells asks again.
    }
  }

  /** Fill in what the address left open. */
  #complete() {
    const { axes, trackers, judged } = this.known;
    const view = this.view;
    const known = (name) => axes.some((axis) => axis.name === name);
    if (!known(view.x)) view.x = axes[0]?.name ?? NO_AXIS;
    if (!known(view.y) || view.y === view.x) view.y = axes.find(({ name }) => name !== view.x)?.name ?? NO_AXIS;
    const ids = trackers.map(({ id }) => id);
    if (!ids.includes(view.first)) view.first = ids[0];
    if (!ids.includes(view.second) || view.second === view.first) view.second = ids.find((id) => id !== view.first) ?? ids[0];
    if (!judged) view.measure = "error";
    if (!judged && view.show === "success") view.show = "error";
    if (ids.length < 2 && ["difference", "significance"].includes(view.show)) view.show = judged ? "success" : "error";
  }

  #merge({ at, maps, done }) {
    const { cells } = this;
    if (cells === null) return;
    cells.done = done;
    for (const changed of maps) {
      /** @type {any} */
      const map = cells.maps.find(({ tracker }) => tracker === changed.tracker);
      for (const [name, column] of Object.entries(changed)) {
        if (Array.isArray(column)) at.forEach((index, place) => (map[name][index] = column[place]));
      }
    }
  }

  #tell(...topics) {
    for (const topic of topics) for (const listener of this.#listeners.get(topic) ?? []) listener();
  }
}
