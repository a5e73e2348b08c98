/** All kinds of trace: how each is painted, what is said of the place that is pointed at, and how it looks in a key. */

import * as band from "./band.js";
import * as bars from "./bars.js";
import * as curve from "./curve.js";
import * as heatMap from "./heat_map.js";
import * as histogram from "./histogram.js";
import * as line from "./line.js";
import * as nodes from "./nodes.js";
import * as rule from "./rule.js";
import * as scatter from "./scatter.js";
import * as segments from "./segments.js";
import * as spans from "./spans.js";
import * as stems from "./stems.js";
import * as stripChart from "./strip_chart.js";
import * as tree from "./tree.js";

/** @import { Hit, Sheet } from "../canvas.js" */
/** @import { Trace } from "../traces.js" */

/** @typedef {{index: number, count: number}} Among Which of the panel's traces of this kind it is. */

/**
 * What a kind of trace can do: paint one, say what a pointer is at, and make a small one over 0..1 on both axes for the key.
 * Each is given its own kind only, by `kindOf`.
 *
 * @typedef {{
 *     paint(sheet: Sheet, trace: Trace, among: Among): void,
 *     near(sheet: Sheet, trace: Trace, px: number, py: number, among: Among): Hit|null,
 *     sample(trace: Trace): Trace,
 * }} Kind
 */

/** @type {Record<Trace["kind"], Kind>} */
const KINDS = {
  band,
  bars,
  curve,
  "heat map": heatMap,
  histogram,
  line,
  nodes,
  rule,
  scatter,
  segments,
  spans,
  stems,
  "strip chart": stripChart,
  tree,
};

/** How far marks may stand over the box of their axes, px at letters of 16 px: points at its edge are whole. */
export const OVER = {
  ...{ band: 0, bars: 0, curve: 1, "heat map": 0, histogram: 1, line: 1, nodes: 7, rule: 1, scatter: 6 },
  ...{ segments: 1, spans: 0, stems: 4, "strip chart": 4, tree: 4 },
};

/** @param {Trace} trace */
export function kindOf({ kind }) {
  return KINDS[kind];
}

/**
 * Each trace with which one of its kind it is.
 *
 * @param {readonly Trace[]} traces
 * @returns {{trace: Trace, among: Among}[]}
 */
export function counted(traces) {
  return traces.map((trace) => {
    const alike = traces.filter((each) => each.kind === trace.kind && isStacked(each) === isStacked(trace));
    return { trace, among: { index: alike.indexOf(trace), count: alike.length } };
  });
}

/** @param {Trace} trace */
function isStacked(trace) {
  return trace.kind === "bars" && trace.stacked;
}
