/** Figures of a look into the frame: numbers with a limit over the last frames, and the ancestors of the present particles. */

import { plainAxis } from "../../shared/figure/axes.js";
import { useFigure } from "../../shared/figure/figure.js";
import { lineOver } from "../../shared/figure/kinds.js";
import { count } from "../../shared/format.js";
import { h, html, useLayoutEffect } from "../../vendor/preact.js";

/** @import { Course, GenealogyPublic } from "../../shared/messages.js" */
/** @import { Panel } from "../../shared/figure/traces.js" */

const LETTERS = 11 / 16;
const SPACE = 1.1;
/** Of so few frames each is numbered. */
const FEW = 4;
/** Lines that run close together still stand apart. */
const OPACITY = 0.6;
const PANEL = { title: "", handles: [], words: "" };

/** @param {{label: string, panels: Panel[]}} props */
function Figure({ label, panels }) {
  const { room, figure } = useFigure({}, { isCompact: true, letters: LETTERS });
  useLayoutEffect(() => figure.current?.show({ panels }, { locked: true }), [panels]);
  return html`<div ref=${room} class="lineage" role="img" aria-label=${label}></div>`;
}

/**
 * Numbers such as the normalised innovation squared of a Kalman filter.
 *
 * @param {{courses: readonly Course[]}} props
 */
export function Courses({ courses }) {
  return html`<section class="inspection-course">
    <h3>${courses.map(({ title }) => title).join(", ")}</h3>
    ${h(Figure, { label: "The number over the last frames, and its limit", panels: courses.map(coursePanel) })}
  </section>`;
}

/**
 * The ancestors as lines that lead back and meet: how soon, shows impoverishment.
 *
 * @param {{genealogy: GenealogyPublic, frame: number}} props
 */
export function Genealogy({ genealogy, frame }) {
  const label = "The ancestors of the particles of this frame, as lines that lead back and meet";
  return html`<section class="inspection-genealogy">
    <h3>Genealogy</h3>
    ${h(Figure, { label, panels: [genealogyPanel(genealogy, frame)] })}
    <p class="small">${said(genealogy)}</p>
  </section>`;
}

/**
 * @param {Course} course
 * @param {number} row
 * @returns {Panel}
 */
function coursePanel({ title, limit, first, values }, row) {
  const x = values.map((_, place) => first + place);
  const y = values.map((value) => value ?? NaN);
  const last = first + values.length - 1;
  return {
    ...{ ...PANEL, id: title, row, share: [1, 1] },
    x: plainAxis({ low: first, high: last }),
    y: plainAxis({ low: 0, high: SPACE * Math.max(limit, ...y.filter(Number.isFinite)) }),
    traces: [
      lineOver({ name: `${title} limit`, ink: "muted", width: 1.8, dashed: true, x: [first, last], y: [limit, limit] }),
      lineOver({ name: title, ink: "estimate", width: 1.8, x, y, said: title }),
    ],
  };
}

/**
 * @param {GenealogyPublic} genealogy
 * @param {number} frame
 * @returns {Panel}
 */
function genealogyPanel({ first, lines }, frame) {
  const steps = lines.flatMap((line) => line.slice(1).map((height, place) => ({ x0: first + place, y0: line[place] ?? NaN, y1: height ?? NaN })))
    .filter(({ y0 }) => !Number.isNaN(y0));
  // Where lines have met they are one.
  const edges = [...new Map(steps.map((step) => [`${step.x0} ${step.y0} ${step.y1}`, step])).values()];
  // Every frame has its number where there are few: there is nothing between two of them.
  const ticks = Array.from({ length: frame - first + 1 }, (_, place) => ({ at: first + place, text: String(first + place) }));
  return {
    ...{ ...PANEL, id: "genealogy", row: 0, share: [1, 1] },
    x: plainAxis({ low: first, high: frame, ...(frame - first <= FEW && { ticks }) }),
    y: plainAxis({ low: 0, high: 1, ticks: [] }),
    traces: [
      {
        ...{ kind: "segments", title: "", name: "ancestors", ink: "estimate", opacity: edges.map(() => OPACITY) },
        ...{ x0: edges.map(({ x0 }) => x0), y0: edges.map(({ y0 }) => y0), x1: edges.map(({ x0 }) => x0 + 1), y1: edges.map(({ y1 }) => y1) },
      },
    ],
  };
}

/** @param {GenealogyPublic} genealogy */
function said({ first, counts, coalesced, lines }) {
  const of = counts[counts.length - 1];
  if (coalesced !== null) return `All ${of} particles descend from one of frame ${coalesced}.`;
  if (lines.some(([oldest]) => oldest === null)) return `The ${of} particles have ${count(counts[0], "ancestor")} in frame ${first}; other lines begin later.`;
  return `The ${of} particles descend from ${counts[0]} of frame ${first}.`;
}
