/** A value over steps of time: a line with a dot at each step. */

import { paintPoints } from "../points.js";
import { nearestOf, pathThrough } from "../polyline.js";
import { stroke } from "../canvas.js";
import { named, saying } from "../description.js";

/** @import { StripChart } from "../traces.js" */
/** @import { Hit, Sheet } from "../canvas.js" */

const LINE = 1.5;
const DOT = 3.2;
/** Closer together than that dots would be a thick line, px. */
const APART = 5;

/**
 * @param {Sheet} sheet
 * @param {StripChart} chart
 */
export function paint(sheet, chart) {
  const [x, y] = [sheet.x.all(chart.x), sheet.y.all(chart.y)];
  stroke(sheet, pathThrough(x, y), chart.ink, { solid: LINE });
  if (x.length * APART * sheet.unit > sheet.box.width * 2) return;
  paintPoints(sheet, { x, y }, chart.ink, DOT * sheet.unit);
}

/**
 * @param {Sheet} sheet
 * @param {StripChart} chart
 * @param {number} px
 * @param {number} py
 * @returns {Hit|null}
 */
export function near(sheet, chart, px, py) {
  const hit = nearestOf(sheet.x.all(chart.x), sheet.y.all(chart.y), px, py);
  if (hit === null) return null;
  const { axes } = sheet;
  return { ...hit, words: saying(chart, named(axes.x, Number(chart.x[hit.index])), named(axes.y, Number(chart.y[hit.index]))) };
}

/**
 * @param {StripChart} chart
 * @returns {StripChart} For the key.
 */
export function sample(chart) {
  return { ...chart, x: [0.1, 0.5, 0.9], y: [0.3, 0.7, 0.5] };
}
