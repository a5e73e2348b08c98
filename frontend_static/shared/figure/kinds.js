/** All kinds of trace: their painting, the tooltip at a place, and their look in a key. */

import { named, saying, valueOn, written } from "./axes.js";
import { byOpacity, DASHED, fill, heatMap, LOOKS, pathBetween, pathThrough, points, REACH, stroke, within } from "./paint.js";

/** @import { Hit, Sheet } from "./paint.js" */
/** @import { Band, Bars, Curve, Histogram, Line, Nodes, Rule, Scatter, Segments, Spans, Stems, StripChart, Trace, Tree } from "./traces.js" */

/** The functions of a kind of trace. `alike` are all traces of the panel.
 *
 * @template {Trace} T
 * @typedef {{
 *     over: number,
 *     paint(sheet: Sheet, trace: T, alike: readonly Trace[]): void,
 *     near?(sheet: Sheet, trace: T, px: number, py: number, alike: readonly Trace[]): Hit|null,
 *     sample?(trace: T): Trace,
 * }} Kind `over` is how far its marks may stand over the box of the axes, px at letters of 16 px: points at its edge are whole.
 *     `near` is what a pointer is at; without it the trace is read elsewhere. `sample` is a small one for the key, over 0..1 on
 *     both axes; without it the trace itself is painted there.
 */

const SHADE = 0.3;
/** Cached format of values at the pointer: making a format takes longer than using it a hundred times. */
const VALUE = new Intl.NumberFormat("en-GB", { maximumSignificantDigits: 4 });
/** Width of a bar, as a share of the distance between bars. */
const WIDE = 0.8;
/** Opacities of a stack, so that neighbours differ. */
const SHADES = [0.75, 0.3, 0.5];
/** Number of points from which they become translucent, more so with more points, and the least opacity. */
const [CROWDED, CROWDED_OPACITY] = [500, 0.2];
const HEAD = 3.2;
/** Most stems side by side with distinguishable heads. */
const MOST_HEADS = 1500;
/** Least distance of dots, px; closer ones would look like a thick line. */
const APART = 5;
/** Least opacity in a tree, so that improbable nodes stay visible. */
const FAINTEST = 0.12;
const NODE = 3;

/** @typedef {{x: readonly (number|null)[], y: readonly (number|null)[]}} Points */

/** The coordinates of a trace's points.
 *
 * @param {Sheet} sheet
 * @param {Points} trace
 */
function placed({ x, y }, trace) {
  return /** @type {const} */ ([x.all(trace.x), y.all(trace.y)]);
}

/** The values of a trace's nearest point.
 *
 * @param {Sheet} sheet
 * @param {Points & Trace} trace
 * @param {number} px
 * @param {number} py
 */
function nearPoint(sheet, trace, px, py) {
  const { x, y } = sheet.axes;
  const hit = nearestOf(...placed(sheet, trace), px, py);
  return hit && { ...hit, words: saying(trace, named(x, Number(trace.x[hit.index])), named(y, Number(trace.y[hit.index]))) };
}

/** The look of a lesson's line.
 *
 * @param {{ink: string, dashed: boolean}} trace
 */
function look({ ink, dashed }) {
  return { ink, ...LOOKS[ink], ...(dashed && { dash: DASHED }) };
}

/** The area between two lines, such as two standard deviations around an estimate; the line in it has the tooltip.
 *
 * @type {Kind<Band>}
 */
const band = {
  over: 0,
  paint: (sheet, { x, low, high, ink, opacity }) =>
    fill(sheet, pathBetween(sheet.x.all(x), sheet.y.all(low), sheet.y.all(high)), ink, opacity),
  sample: (trace) => ({ ...trace, x: [0, 1], low: [0, 0], high: [1, 1] }),
};

/** Bars at 0, 1, 2, ... of the axis with names; or end to end, as shares of a whole.
 *
 * @type {Kind<Bars>}
 */
const bars = {
  over: 0,
  paint(sheet, trace, alike) {
    const outlines = new Path2D();
    laid(sheet, trace, alike).forEach(({ left, top, width, height, index }) => {
      const path = new Path2D();
      path.rect(left, top, width, height);
      fill(sheet, path, trace.ink, trace.stacked ? SHADES[index % SHADES.length] : 0.6);
      outlines.addPath(path);
    });
    stroke(sheet, outlines, { ink: trace.ink, width: 1 });
  },
  near(sheet, trace, px, py, alike) {
    const isIn = (/** @type {Bar} */ { left, top, width, height }) => px >= left && px <= left + width && py >= top && py <= top + height;
    const hit = laid(sheet, trace, alike).find(isIn);
    if (hit === undefined) return null;
    const { x, y } = sheet.axes;
    const [place, amount] = isLying(sheet) ? [y, x] : [x, y];
    const words = trace.stacked
      ? saying(trace, `number ${hit.index + 1}`, written(Number(hit.value.toPrecision(3))))
      : saying(trace, valueOn(place, hit.index), named(amount, hit.value));
    return { distance: REACH * sheet.unit, x: hit.left + hit.width / 2, y: hit.top, words };
  },
  sample: (trace) => ({ ...trace, heights: trace.stacked ? [0.45, 0.3, 0.25] : [0.9, 0.5] }),
};

/** @typedef {{left: number, top: number, width: number, height: number, value: number, index: number}} Bar px */

/** The place of each bar, next to those of the panel's other traces of bars.
 *
 * @param {Sheet} sheet
 * @param {Bars} trace
 * @param {readonly Trace[]} alike
 * @returns {Bar[]}
 */
function laid(sheet, trace, alike) {
  const beside = alike.filter((each) => each.kind === "bars" && each.stacked === trace.stacked);
  const [which, count] = [Math.max(0, beside.indexOf(trace)), Math.max(1, beside.length)];
  const isFlat = trace.stacked || isLying(sheet);
  const [along, up] = isFlat ? [sheet.y, sheet.x] : [sheet.x, sheet.y];
  let before = trace.stacked ? 0 : up.ground;
  return trace.heights.flatMap((height, index) => {
    if (height === null && !trace.stacked) return [];
    const value = height ?? 0;
    const [from, to] = trace.stacked ? stackEnds(sheet, which) : [0, 1].map((end) => index - WIDE / 2 + (WIDE * (which + end)) / count);
    const across = [along.at(from), along.at(to)].sort((one, other) => one - other);
    const upwards = [up.at(before), up.at(trace.stacked ? before + value : value)].sort((one, other) => one - other);
    if (trace.stacked) before += value;
    const [[left, right], [top, bottom]] = isFlat ? [upwards, across] : [across, upwards];
    return [{ left, top, width: right - left, height: bottom - top, value, index }];
  });
}

/** The vertical range of a stack.
 *
 * @param {Sheet} sheet
 * @param {number} which
 */
function stackEnds({ axes }, which) {
  return axes.y.names.length ? [which - WIDE / 2, which + WIDE / 2] : [0, 1];
}

/** @param {Sheet} sheet */
function isLying({ axes }) {
  return axes.y.names.length > 0 && axes.x.names.length === 0;
}

/**
 * A line through points, with a shaded area below a part of it.
 *
 * @type {Kind<Curve>}
 */
const curve = {
  over: 1,
  paint(sheet, trace) {
    const [x, y] = placed(sheet, trace);
    if (trace.area !== null) {
      const [left, right] = trace.area.map((value) => sheet.x.at(value)).sort((one, other) => one - other);
      const ground = new Float64Array(x.length).fill(sheet.y.at(sheet.y.ground));
      const below = { pen: sheet.pen, box: { ...sheet.box, left, width: right - left } };
      within(below, 0, () => fill(sheet, pathBetween(x, ground, y), trace.ink, SHADE));
    }
    stroke(sheet, pathThrough(x, y), look(trace));
  },
  near(sheet, trace, px, py) {
    const hit = nearestOn(...placed(sheet, trace), px, py);
    const { x, y, axes } = sheet;
    return hit && { ...hit, words: saying(trace, named(axes.x, x.value(hit.x)), named(axes.y, y.value(hit.y))) };
  },
  sample: (trace) => ({ ...trace, x: [0, 1], y: [0.5, 0.5], area: trace.area && [0, 1] }),
};

/**
 * Adjoining bars over intervals.
 *
 * @type {Kind<Histogram>}
 */
const histogram = {
  over: 1,
  paint(sheet, { edges, heights, ink }) {
    const [x, y] = [sheet.x.all(edges), sheet.y.all(heights)];
    const ground = sheet.y.at(sheet.y.ground);
    const [areas, outline] = [new Path2D(), new Path2D()];
    heights.forEach((_, index) => {
      if (!Number.isFinite(y[index])) return;
      areas.rect(x[index], y[index], x[index + 1] - x[index], ground - y[index]);
      const before = Number.isFinite(y[index - 1]) ? y[index - 1] : ground;
      outline.moveTo(x[index], Math.max(before, ground));
      outline.lineTo(x[index], y[index]);
      outline.lineTo(x[index + 1], y[index]);
      outline.lineTo(x[index + 1], ground);
    });
    fill(sheet, areas, ink, SHADE);
    stroke(sheet, outline, { ink, width: 1 });
  },
  near(sheet, trace, px, py) {
    const { edges, heights } = trace;
    const ground = sheet.y.at(sheet.y.ground);
    const index = heights.findIndex((height, bar) => {
      const [left, right, top] = [sheet.x.at(edges[bar]), sheet.x.at(edges[bar + 1]), sheet.y.at(height)];
      return px >= left && px < right && py >= Math.min(top, ground) && py <= Math.max(top, ground);
    });
    const [height, from, to] = [heights[index], edges[index], edges[index + 1]];
    if (index < 0 || height === null || from === null || to === null) return null;
    const { x, y } = sheet.axes;
    const words = saying(trace, `${x.title} ${valueOn(x, from)} to ${valueOn(x, to)}`.trim(), named(y, height));
    return { distance: REACH * sheet.unit, x: sheet.x.at((from + to) / 2), y: sheet.y.at(height), words };
  },
  sample: (trace) => ({ ...trace, edges: [0, 1 / 3, 2 / 3, 1], heights: [0.4, 1, 0.7] }),
};

/** A line through points with its own colour and width: one of many in a growing plot.
 *
 * @type {Kind<Line>}
 */
const line = {
  over: 1,
  paint: (sheet, trace) => stroke(sheet, pathThrough(...placed(sheet, trace)), { ...trace, dash: trace.dashed ? DASHED : [] }),
  near(sheet, trace, px, py) {
    const hit = trace.said === "" ? null : nearestOf(...placed(sheet, trace), px, py);
    return hit && { ...hit, words: `frame ${Math.round(trace.x[hit.index])} · ${told(trace, hit.index)}` };
  },
  sample: (trace) => ({ ...trace, x: [0, 1], y: [0.5, 0.5] }),
};

/** A line over the frames; without words it has no tooltip.
 *
 * @param {Partial<Line> & Pick<Line, "y"|"ink"|"width">} trace
 * @returns {Line}
 */
export function lineOver(trace) {
  return { kind: "line", title: "", name: "", said: "", unit: "", ...trace, x: trace.x ?? [...trace.y.keys()] };
}

/**
 * "error 3.142 px": a value of a line in words.
 *
 * @param {Line} line
 * @param {number} index
 */
export function told({ y, values = y, said, unit }, index) {
  return `${said} ${VALUE.format(values[index]).replace("-", "−")} ${unit}`.trim();
}

/** Discs with given opacities, or rings around chosen nodes. The text next to the plot explains nodes.
 *
 * @type {Kind<Nodes>}
 */
const nodes = {
  over: 7,
  paint: (sheet, trace) =>
    points(sheet, ...placed(sheet, trace), { ...trace, radius: (trace.size_px / 2) * sheet.unit, shape: trace.ring ? "ring" : "disc" }),
};

/**
 * A line across the panel at a value.
 *
 * @type {Kind<Rule>}
 */
const rule = {
  over: 1,
  paint(sheet, trace) {
    const { left, top, width, height } = sheet.box;
    const at = sheet[trace.along].at(trace.at);
    const [x, y] = trace.along === "x" ? [[at, at], [top, top + height]] : [[left, left + width], [at, at]];
    stroke(sheet, pathThrough(Float64Array.from(x), Float64Array.from(y)), look(trace));
  },
  near(sheet, trace, px, py) {
    const at = sheet[trace.along].at(trace.at);
    const [x, y] = trace.along === "x" ? [at, py] : [px, at];
    return { x, y, distance: Math.hypot(x - px, y - py), words: saying(trace, named(sheet.axes[trace.along], trace.at)) };
  },
  sample: (trace) => ({ ...trace, at: 0.5 }),
};

/** @type {Kind<Scatter>} */
const scatter = {
  over: 6,
  paint(sheet, { x, y, ink, size_px: size }) {
    const opacity = Math.max(CROWDED_OPACITY, Math.min(1, Math.sqrt(CROWDED / x.length)));
    points(sheet, sheet.x.held(x), sheet.y.held(y), { ink, opacity, radius: (size / 2) * sheet.unit });
  },
  near: nearPoint,
  sample: (trace) => ({ ...trace, x: [0.2, 0.5, 0.8], y: [0.3, 0.7, 0.4], size_px: Math.min(Math.max(5, trace.size_px), 7) }),
};

/** Lines from point to point with given opacities: hypotheses from frame to frame. Their nodes have the tooltips.
 *
 * @type {Kind<Segments>}
 */
const segments = {
  over: 1,
  paint: (sheet, { links, ink, width = 1.8 }) => {
    const paths = byOpacity(links.length, links.map(({ opacity }) => opacity), (index, path) => {
      const { x0, y0, x1, y1 } = links[index];
      if (!Number.isFinite(x0 + y0 + x1 + y1)) return;
      path.moveTo(sheet.x.at(x0), sheet.y.at(y0));
      path.lineTo(sheet.x.at(x1), sheet.y.at(y1));
    });
    for (const [opacity, path] of paths) stroke(sheet, path, { ink, width, opacity });
  },
};

/** Lines from point to point without a tooltip.
 *
 * @param {Partial<Segments> & Pick<Segments, "ink"|"links">} trace
 * @returns {Segments}
 */
export function linksOver(trace) {
  return { kind: "segments", title: "", name: "", ...trace };
}

/** Shaded intervals in the background.
 *
 * @type {Kind<Spans>}
 */
const spans = {
  over: 0,
  paint(sheet, { intervals, ink, opacity }) {
    const { box, x, y } = sheet;
    const path = new Path2D();
    for (const { first, last, low, high } of intervals) {
      const [left, right] = [x.at(first), x.at(last)];
      const [top, bottom] = low === undefined || high === undefined ? [box.top, box.top + box.height] : [y.at(low), y.at(high)];
      path.rect(left, Math.min(top, bottom), Math.max(1, right - left), Math.abs(bottom - top));
    }
    fill(sheet, path, ink, opacity);
  },
  sample: (trace) => ({ ...trace, intervals: [{ first: 0, last: 1 }] }),
};

/**
 * Lines from the ground up to points.
 *
 * @type {Kind<Stems>}
 */
const stems = {
  over: 4,
  paint(sheet, { x: along, y: up, ink }) {
    const [x, y] = [sheet.x.held(along), sheet.y.all(up)];
    const ground = sheet.y.at(sheet.y.ground);
    const path = new Path2D();
    x.forEach((at, index) => {
      path.moveTo(at, ground);
      path.lineTo(at, y[index]);
    });
    stroke(sheet, path, { ink, width: 1 });
    points(sheet, x, y, { ink, radius: (x.length > MOST_HEADS ? HEAD / 2 : HEAD) * sheet.unit });
  },
  near: nearPoint,
  sample: (trace) => ({ ...trace, x: [0.2, 0.5, 0.8], y: [0.5, 0.85, 0.35] }),
};

/**
 * A value over steps of time: a line with a dot at each step.
 *
 * @type {Kind<StripChart>}
 */
const stripChart = {
  over: 4,
  paint(sheet, trace) {
    const [x, y] = placed(sheet, trace);
    const { ink } = trace;
    stroke(sheet, pathThrough(x, y), { ink, width: 1.5 });
    if (x.length * APART * sheet.unit <= sheet.box.width * 2) points(sheet, x, y, { ink, radius: HEAD * sheet.unit });
  },
  near: nearPoint,
  sample: (trace) => ({ ...trace, x: [0.1, 0.5, 0.9], y: [0.3, 0.7, 0.5] }),
};

/** A genealogy: generations to the right, a line from each particle to its parent.
 *
 * @type {Kind<Tree>}
 */
const tree = {
  over: 4,
  paint(sheet, { parents, weights, ink }) {
    const all = parents.flatMap((row, generation) =>
      row.map((parent, particle) => ({ generation, particle, parent, weight: weights[generation]?.[particle] ?? 0 })),
    );
    const opacity = all.map(({ weight }) => FAINTEST + (1 - FAINTEST) * Math.min(Math.max(weight, 0), 1));
    const [x, y] = [sheet.x.all(all.map(({ generation }) => generation)), sheet.y.all(all.map(({ particle }) => particle))];
    const links = all.map(({ generation, particle, parent }, index) =>
      ({ x0: generation - 1, y0: parent ?? NaN, x1: generation, y1: particle, opacity: opacity[index] }),
    );
    segments.paint(sheet, linksOver({ ink, width: 1.25, links }), []);
    points(sheet, x, y, { ink, opacity, radius: Math.min(NODE * sheet.unit, Math.abs(sheet.y.at(1) - sheet.y.at(0)) * 0.4), shape: "disc" });
  },
  near(sheet, trace, px, py) {
    const generation = Math.round(sheet.x.value(px));
    const parents = trace.parents[generation];
    if (parents === undefined) return null;
    const rows = Float64Array.from(parents.keys(), (row) => sheet.y.at(row));
    const hit = nearestOf(rows.map(() => sheet.x.at(generation)), rows, px, py);
    if (hit === null) return null;
    const parent = parents[hit.index];
    const descent = parent === null ? "" : `child of ${parent + 1}`;
    return { ...hit, words: saying(trace, `particle ${hit.index + 1} of generation ${generation}`, descent) };
  },
  sample: (trace) => ({ ...trace, parents: [[null, null], [0, 0]], weights: [[1, 0], [1, 1]] }),
};

/** The kind of a trace.
 *
 * @type {Record<Trace["kind"], Kind<Trace>>}
 */
export const KINDS = {
  ...{ band, bars, curve, "heat map": heatMap, histogram, line, nodes, rule },
  ...{ scatter, segments, spans, stems, "strip chart": stripChart, tree },
};

/** The point on a line nearest to a pointer.
 *
 * @param {Float64Array} x px
 * @param {Float64Array} y px
 * @param {number} px
 * @param {number} py
 * @returns {{x: number, y: number, distance: number}|null}
 */
export function nearestOn(x, y, px, py) {
  /** @type {{x: number, y: number, distance: number}|null} */
  let nearest = null;
  for (let index = 0; index + 1 < x.length; index += 1) {
    const [dx, dy] = [x[index + 1] - x[index], y[index + 1] - y[index]];
    const along = ((px - x[index]) * dx + (py - y[index]) * dy) / (dx * dx + dy * dy || 1);
    const share = Math.min(Math.max(along, 0), 1);
    const [atX, atY] = [x[index] + share * dx, y[index] + share * dy];
    const distance = Math.hypot(atX - px, atY - py);
    if (distance < (nearest?.distance ?? Infinity)) nearest = { x: atX, y: atY, distance };
  }
  return nearest;
}

/** The point nearest to a pointer.
 *
 * @param {Float64Array} x px
 * @param {Float64Array} y px
 * @param {number} px
 * @param {number} py
 * @returns {{x: number, y: number, distance: number, index: number}|null}
 */
export function nearestOf(x, y, px, py) {
  let [found, least] = [-1, Infinity];
  for (let index = 0; index < x.length; index += 1) {
    const squared = (x[index] - px) ** 2 + (y[index] - py) ** 2;
    if (squared < least) [found, least] = [index, squared];
  }
  return found < 0 ? null : { x: x[found], y: y[found], distance: Math.sqrt(least), index: found };
}
