/** Points. */

import { paintPoints } from "../points.js";
import { nearestOf } from "../polyline.js";
import { named, saying } from "../description.js";

/** @import { Scatter } from "../traces.js" */
/** @import { Hit, Sheet } from "../canvas.js" */

/** Of so many points each lets those below shine through, the more the more there are; down to this. */
const [CROWDED, CROWDED_OPACITY] = [500, 0.2];

/**
 * @param {Sheet} sheet
 * @param {Scatter} scatter
 */
export function paint(sheet, scatter) {
  const opacity = Math.max(CROWDED_OPACITY, Math.min(1, Math.sqrt(CROWDED / scatter.x.length)));
  const places = { x: sheet.x.held(scatter.x), y: sheet.y.held(scatter.y), opacity: new Float64Array(scatter.x.length).fill(opacity) };
  paintPoints(sheet, places, scatter.ink, (scatter.size_px / 2) * sheet.unit);
}

/**
 * @param {Sheet} sheet
 * @param {Scatter} scatter
 * @param {number} px
 * @param {number} py
 * @returns {Hit|null}
 */
export function near(sheet, scatter, px, py) {
  const hit = nearestOf(sheet.x.all(scatter.x), sheet.y.all(scatter.y), px, py);
  if (hit === null) return null;
  const { axes } = sheet;
  return { ...hit, words: saying(scatter, named(axes.x, Number(scatter.x[hit.index])), named(axes.y, Number(scatter.y[hit.index]))) };
}

/**
 * @param {Scatter} scatter
 * @returns {Scatter} For the key.
 */
export function sample(scatter) {
  return { ...scatter, x: [0.2, 0.5, 0.8], y: [0.3, 0.7, 0.4], size_px: Math.min(Math.max(5, scatter.size_px), 7) };
}
