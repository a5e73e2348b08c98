/**
 * Hypotheses with their parents: a row for each place among those of a frame, the more opaque the more probable, and the
 * way back from the most probable one of the newest frame; of the active branch alone. One that is clicked at, or chosen by
 * the arrows up and down, is shown in its frame.
 */

import { api } from "../../../shared/api.js";
import { number } from "../../../shared/format.js";
import { attempt } from "../../../shared/toast.js";
import { hypothesesOf } from "../../series.js";
import { Lines } from "../lines.js";
import { Plot, made } from "./plot.js";
import { key } from "./samplers.js";

/** @import { History, Row } from "../../history.js" */
/** @import { View } from "../../mount.js" */
/** @import { Store } from "../../store.js" */
/** @import { BokehApi, Range, Renderer } from "../bokeh_api.js" */
/** @import { Ink } from "../figure.js" */

/** What is hardly probable at all is still seen. */
const FAINTEST = 0.12;
const NODE_PX = 8;
const RING_PX = 14;

export class TreePlot extends Plot {
  rows = 4;
  /** How many rows there are. */
  #places = 0;
  /** @type {Lines|null} */
  #edges = null;
  /** @type {Lines|null} */
  #nodes = null;
  /** @type {Renderer|null} */
  #way = null;
  /** @type {Renderer|null} */
  #ring = null;
  /** What the way back was drawn of, and where the ring is. */
  #seen = { way: "", ring: "" };
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
   * @param {BokehApi} Bokeh
   * @param {Range} frames
   */
  build(Bokeh, frames) {
    super.build(Bokeh, frames, { ticks: [1] });
    const { figure } = this;
    const [name] = this.declared.series;
    const [x, y, fill_alpha] = ["frame", "place", "alpha"].map((field) => ({ field }));
    this.#way = figure.line(figure.source({ frame: [], place: [] }), "place", { name: `${this.id} way`, line_width: 7, line_alpha: 0.45 });
    this.#edges = new Lines(
      figure,
      (history, from) => edges(history, from, name),
      (source) => ({ active: [figure.segments(source, { name: `${this.id} edges`, tags: ["branch"] })] }),
    );
    this.#nodes = new Lines(
      figure,
      (history, from) => nodes(history, from, name),
      (source) => ({
        active: [figure.model.scatter(x, y, { source, size: NODE_PX, line_color: null, fill_alpha, name: this.id, tags: ["branch"] })],
      }),
      ["place"],
    );
    const here = figure.source({ frame: [], place: [] });
    this.#ring = figure.model.scatter(x, y, { source: here, size: RING_PX, fill_color: null, line_width: 2, level: "overlay", name: `${this.id} shown` });
  }

  /**
   * @param {Ink} ink
   * @param {boolean} sparkline
   */
  dress(ink, sparkline) {
    super.dress(ink, sparkline);
    made(this.#way).glyph.line_color = ink.muted;
    made(this.#ring).glyph.line_color = ink.ink;
  }

  /** @param {Store} store */
  draw(store) {
    super.draw(store);
    const { known, history } = store;
    const drawn = made(this.#nodes);
    made(this.#edges).draw(store);
    drawn.draw(store);
    this.#reach(drawn.most);
    const seen = `${known.branch} ${history.edition} ${history.length}`;
    if (seen !== this.#seen.way) made(this.#way).data_source.data = wayBack(history, this.declared.series[0]);
    const [place, count] = [this.#shown(store), this.#here(store).weights.length];
    const ring = `${known.position} ${place}`;
    if (ring !== this.#seen.ring) made(this.#ring).data_source.data = place === 0 ? { frame: [], place: [] } : { frame: [known.position], place: [place] };
    this.#seen = { way: seen, ring };
    if (this.#place === null || this.declared.shown === "") return;
    for (const [name, value] of Object.entries({ now: Math.max(1, place), max: Math.max(1, count), text: this.reading(store) })) {
      this.#place.setAttribute(`aria-value${name}`, String(value));
    }
  }

  /**
   * Take clicks and arrows for a choice.
   *
   * @param {HTMLElement} place
   * @param {View} view
   */
  listen(place, view) {
    this.figure.model.on_event("tap", ({ x, y }) => {
      const frame = Math.round(x);
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
    if (shown !== "") await attempt(() => api.parameters(store.known.id, { [shown]: place }));
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

  /** @param {number} places */
  #reach(places) {
    if (places === this.#places || places === 0) return;
    this.#places = places;
    const { model, range } = this.figure;
    // The first at the top.
    [range.start, range.end] = [places + 0.6, 0.4];
    const ticks = Array.from({ length: places }, (_, place) => place + 1);
    model.yaxes[0].ticker.ticks = model.ygrids[0].ticker.ticks = ticks;
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
  /** @type {Record<string, number[]>} */
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
  /** @type {Record<string, number[]>} */
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
  /** @type {Record<string, number[]>} */
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
