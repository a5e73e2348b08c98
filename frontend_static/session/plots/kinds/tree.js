/**
 * Hypotheses with their parents: a row for each place among those of a frame, the more opaque the more probable, and the
 * way back from the most probable one of the newest frame; of the active branch alone. One that is clicked at, or chosen by
 * the arrows up and down, is shown in its frame.
 */

import { api } from "../../../shared/api.js";
import { number } from "../../../shared/format.js";
import { attempt } from "../../../shared/toast.js";
import { hypothesesOf } from "../../series.js";
import { BranchColumns } from "../branch_columns.js";
import { Plot } from "./plot.js";
import { key } from "./samplers.js";

/** @import { History, Row } from "../../history.js" */
/** @import { View } from "../../mount.js" */
/** @import { Store } from "../../store.js" */
/** @import { FigureView } from "../../../shared/figure/figure.js" */
/** @import { Trace } from "../../../shared/figure/traces.js" */
/** @import { Columns } from "../branch_columns.js" */
/** @import { Limits } from "./plot.js" */

/** What is hardly probable at all is still seen. */
const FAINTEST = 0.12;
const NODE_PX = 8;
const RING_PX = 14;

export class TreePlot extends Plot {
  rows = 4;
  #edges = new BranchColumns((history, from) => edges(history, from, this.declared.series[0]), { onlyActive: true });
  #nodes = new BranchColumns((history, from) => nodes(history, from, this.declared.series[0]), { limits: ["place"], onlyActive: true });
  /** The way back, and what it was found of. */
  #way = { seen: "", data: /** @type {Columns} */ ({ frame: [], place: [] }) };
  /** @type {HTMLElement|null} */
  #place = null;

  heading() {
    return [`${this.declared.title} `, key("muted", "way back")];
  }

  /** @param {Store} store */
  reading(store) {
    const { weights } = this.#here(store);
    const place = this.#shown(store);
    return place === 0 ? number(null) : `${place} of ${weights.length}, ${number(100 * weights[place - 1], 0)} %`;
  }

  /**
   * @param {Store} store
   * @returns {Trace[]}
   */
  traces(store) {
    const { known, history } = store;
    const seen = `${known.branch} ${history.edition} ${history.length}`;
    if (seen !== this.#way.seen) this.#way = { seen, data: wayBack(history, this.declared.series[0]) };
    this.#tell(store);
    const { data: way } = this.#way;
    const place = this.#shown(store);
    const here = place === 0 ? { x: [], y: [], opacity: [] } : { x: [known.position], y: [place], opacity: [1] };
    return [
      this.line({ name: `${this.id} way`, x: way.frame, y: way.place, ink: "muted", width: 7, opacity: 0.45, said: "" }),
      ...this.#edges.update(store).map(
        ({ branch, data }) =>
          /** @type {Trace} */ ({
            ...{ kind: "segments", title: "", name: `${this.id} edges`, ink: branch.colour, opacity: data.alpha },
            ...{ x0: data.frame, y0: data.y0, x1: data.x1, y1: data.y1 },
          }),
      ),
      ...this.#nodes.update(store).map(
        ({ branch, data }) =>
          /** @type {Trace} */ ({
            ...{ kind: "nodes", title: "", name: this.id, ink: branch.colour, ring: false, size_px: NODE_PX },
            ...{ x: data.frame, y: data.place, opacity: data.alpha },
          }),
      ),
      { kind: "nodes", title: "", name: `${this.id} shown`, ink: "ink", ring: true, size_px: RING_PX, ...here },
    ];
  }

  /** @returns {Limits} */
  limits() {
    const places = Math.max(1, this.#nodes.most);
    // The first at the top.
    return { low: places + 0.6, high: 0.4, ticks: Array.from({ length: places }, (_, place) => ({ at: place + 1, text: String(place + 1) })) };
  }

  /**
   * Say which one is shown, where it can be chosen.
   *
   * @param {Store} store
   */
  #tell(store) {
    if (this.#place === null || this.declared.shown === "") return;
    const [place, count] = [this.#shown(store), this.#here(store).weights.length];
    for (const [name, value] of Object.entries({ now: Math.max(1, place), max: Math.max(1, count), text: this.reading(store) })) {
      this.#place.setAttribute(`aria-value${name}`, String(value));
    }
  }

  /**
   * Take clicks and arrows for a choice.
   *
   * @param {HTMLElement} place
   * @param {FigureView} figure
   * @param {View} view
   */
  listen(place, figure, view) {
    place.addEventListener("click", (event) => {
      const at = figure.valuesAt(this.id, event);
      if (at === null) return;
      const [frame, y] = [Math.round(at.x), at.y];
      const count = knownOf(view.store.history.at(frame), this.declared.series[0]).weights.length;
      if (count > 0) this.#choose(view, frame, Math.min(Math.max(1, Math.round(y)), count));
    });
    place.classList.add("chooses");
    if (this.declared.shown === "") return;
    this.#place = place;
    for (const [name, value] of Object.entries({ role: "slider", tabindex: 0, "aria-orientation": "vertical", "aria-valuemin": 1 })) {
      place.setAttribute(name, String(value));
    }
    place.addEventListener("keydown", (event) => {
      const step = { ArrowUp: -1, ArrowDown: 1 }[event.key];
      if (step === undefined) return;
      event.preventDefault();
      const wanted = this.#shown(view.store) + step;
      const { weights } = this.#here(view.store);
      if (wanted >= 1 && wanted <= weights.length) this.#choose(view, view.store.known.position, wanted);
    });
  }

  /**
   * @param {View} view
   * @param {number} frame
   * @param {number} place From 1 on.
   */
  async #choose({ able, steering, store }, frame, place) {
    if (!able) return;
    await steering.seek(frame);
    const { shown } = this.declared;
    if (shown !== "") await attempt(() => api.command(store.known.id, { kind: "change", values: { [shown]: place } }));
  }

  /**
   * Which hypothesis of its frame is shown, from 1 on; 0 where the frame has none.
   *
   * @param {Store} store
   */
  #shown(store) {
    const wanted = this.declared.shown === "" ? 1 : Number(store.known.parameters[this.declared.shown]);
    return Math.min(wanted, this.#here(store).weights.length);
  }

  /** @param {Store} store */
  #here({ known, history }) {
    return knownOf(history.at(known.position), this.declared.series[0]);
  }
}

/**
 * Each hypothesis of the frames from one on.
 *
 * @param {History} history
 * @param {number} from
 * @param {string} name Of the series.
 */
export function nodes(history, from, name) {
  /** @type {Columns} */
  const data = { frame: [], place: [], alpha: [] };
  for (let frame = from; frame < history.length; frame += 1) {
    knownOf(history.at(frame), name).weights.forEach((weight, place) => {
      data.frame.push(frame);
      data.place.push(place + 1);
      data.alpha.push(opacity(weight));
    });
  }
  return data;
}

/**
 * From the parent of each hypothesis to itself, of the frames from one on.
 *
 * @param {History} history
 * @param {number} from
 * @param {string} name Of the series.
 */
export function edges(history, from, name) {
  /** @type {Columns} */
  const data = { frame: [], y0: [], x1: [], y1: [], alpha: [] };
  for (let frame = from; frame < history.length; frame += 1) {
    const { weights, parents } = knownOf(history.at(frame), name);
    parents.forEach((parent, place) => {
      if (parent < 0) return;
      data.frame.push(frame - 1);
      data.y0.push(parent + 1);
      data.x1.push(frame);
      data.y1.push(place + 1);
      data.alpha.push(opacity(weights[place]));
    });
  }
  return data;
}

/**
 * The most probable hypothesis of the newest frame, and before it its parents, as far back as they go.
 *
 * @param {History} history
 * @param {string} name Of the series.
 */
export function wayBack(history, name) {
  /** @type {Columns} */
  const data = { frame: [], place: [] };
  let frame = history.length - 1;
  const { weights } = knownOf(history.at(frame), name);
  let place = weights.indexOf(Math.max(...weights));
  while (frame >= 0 && place >= 0) {
    data.frame.push(frame);
    data.place.push(place + 1);
    place = knownOf(history.at(frame), name).parents[place] ?? -1;
    frame -= 1;
  }
  return data;
}

/** @param {number} weight */
function opacity(weight) {
  return FAINTEST + (1 - FAINTEST) * weight;
}

/**
 * The weights and parents of a frame's hypotheses; none where it has none.
 *
 * @param {Row|undefined} row
 * @param {string} name
 */
function knownOf(row, name) {
  const { weights = [], parents = [] } = hypothesesOf(row, name) ?? {};
  return { weights: weights.map((weight) => weight ?? 0), parents };
}
