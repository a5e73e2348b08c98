/** A line through points, in a colour and of a width of its own: one of many in a plot that grows. */

import { nearestOf, pathThrough } from "../polyline.js";
import { line } from "../canvas.js";

/** @import { Hit, Sheet } from "../canvas.js" */
/** @import { Line } from "../traces.js" */

/**
 * @param {Sheet} sheet
 * @param {Line} trace
 */
export function paint(sheet, trace) {
  line(sheet, pathThrough(sheet.x.all(trace.x), sheet.y.all(trace.y)), trace);
}

/**
 * @param {Sheet} sheet
 * @param {Line} trace
 * @param {number} px
 * @param {number} py
 * @returns {Hit|null}
 */
export function near(sheet, { x, y, values = y, said, unit }, px, py) {
  if (said === "") return null;
  const hit = nearestOf(sheet.x.all(x), sheet.y.all(y), px, py);
  if (hit === null) return null;
  const value = values[hit.index].toLocaleString("en-GB", { maximumSignificantDigits: 4 }).replace("-", "−");
  return { ...hit, words: `frame ${Math.round(x[hit.index])} · ${`${said} ${value} ${unit}`.trim()}` };
}

/**
 * @param {Line} trace
 * @returns {Line}
 */
export function sample(trace) {
  return { ...trace, x: [0, 1], y: [0.5, 0.5] };
}
