/** The ancestors of the present particles as lines that lead back and meet: how soon, shows impoverishment. */

import { h, fill } from "../../shared/dom.js";
import { count } from "../../shared/format.js";
import { FigureView } from "../../shared/figure/figure.js";

/** @import { GenealogyPublic, InspectionPublic } from "../../shared/messages.js" */
/** @import { Panel } from "../../shared/figure/traces.js" */

const LETTERS = 11 / 16;
/** Of so few frames each is numbered. */
const FEW = 4;
/** Lines that run close together still stand apart. */
const OPACITY = 0.6;

export class GenealogyFigure {
  #place;
  #words = h("p", { class: "small" });
  #figure;

  /**
   * @param {HTMLElement} place
   * @param {AbortSignal} signal
   */
  constructor(place, signal) {
    this.#place = place;
    const drawing = h("div", { class: "lineage", role: "img", "aria-label": "The ancestors of the particles of this frame, as lines that lead back and meet" });
    fill(place, h("h3", {}, "Genealogy"), drawing, this.#words);
    this.#figure = new FigureView(drawing, {}, signal, { isCompact: true, letters: LETTERS });
  }

  /** @param {InspectionPublic} found */
  show({ genealogy, frame }) {
    this.#place.hidden = genealogy === null || genealogy.counts.length < 2;
    if (genealogy === null || this.#place.hidden) return;
    this.#figure.show({ panels: [panel(genealogy, frame)] }, { locked: true });
    fill(this.#words, said(genealogy));
  }
}

/**
 * @param {GenealogyPublic} genealogy
 * @param {number} frame
 * @returns {Panel}
 */
function panel({ first, lines }, frame) {
  const steps = lines.flatMap((line) => line.slice(1).map((height, place) => ({ x0: first + place, y0: line[place] ?? NaN, y1: height ?? NaN })))
    .filter(({ y0 }) => !Number.isNaN(y0));
  // Where lines have met they are one.
  const edges = [...new Map(steps.map((step) => [`${step.x0} ${step.y0} ${step.y1}`, step])).values()];
  const base = { title: "", unit: "", log: false, names: [], hidden: false };
  return {
    ...{ id: "genealogy", title: "", handles: [], words: "", row: 0, share: [1, 1] },
    x: { ...base, low: first, high: frame, ...(frame - first <= FEW && { ticks: whole(first, frame) }) },
    y: { ...base, low: 0, high: 1, ticks: [] },
    traces: [
      {
        ...{ kind: "segments", title: "", name: "ancestors", ink: "estimate", opacity: edges.map(() => OPACITY) },
        ...{ x0: edges.map(({ x0 }) => x0), y0: edges.map(({ y0 }) => y0), x1: edges.map(({ x0 }) => x0 + 1), y1: edges.map(({ y1 }) => y1) },
      },
    ],
  };
}

/**
 * Every frame has its number where there are few: there is nothing between two of them.
 *
 * @param {number} first
 * @param {number} last
 */
function whole(first, last) {
  return Array.from({ length: last - first + 1 }, (_, place) => ({ at: first + place, text: String(first + place) }));
}

/** @param {GenealogyPublic} genealogy */
function said({ first, counts, coalesced, lines }) {
  const of = counts[counts.length - 1];
  if (coalesced !== null) return `All ${of} particles descend from one of frame ${coalesced}.`;
  if (lines.some(([oldest]) => oldest === null)) return `The ${of} particles have ${count(counts[0], "ancestor")} in frame ${first}; other lines begin later.`;
  return `The ${of} particles descend from ${counts[0]} of frame ${first}.`;
}
