/** Points, as opaque as their weights say. */

import { paintPoints } from "../points.js";
import { nearestOf } from "../polyline.js";
import { named, saying } from "../description.js";

/** @import { Scatter } from "../traces.js" */
/** @import { Hit, Sheet } from "../canvas.js" */

/** What weighs nothing can still be seen. */
const FAINTEST = 0.08;
/** Of so many points without weights each lets those below shine through, the more the more there are; down to this. */
const [CROWDED, CROWDED_OPACITY] = [500, 0.2];

/**
 * @param {Sheet} sheet
 * @param {Scatter} scatter
 */
export function paint(sheet, scatter) {
  const places = { x: sheet.x.held(scatter.x), y: sheet.y.held(scatter.y), opacity: opacities(scatter) };
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
  return { ...scatter, x: [0.2, 0.5, 0.8], y: [0.3, 0.7, 0.4], weights: null, size_px: Math.min(Math.max(5, scatter.size_px), 7) };
}

/** @param {Scatter} scatter */
function opacities({ x, weights }) {
  if (weights === null) return new Float64Array(x.length).fill(Math.max(CROWDED_OPACITY, Math.min(1, Math.sqrt(CROWDED / x.length))));
  return Float64Array.from(weights, (weight) => FAINTEST + (1 - FAINTEST) * Math.min(Math.max(weight ?? 0, 0), 1));
}
