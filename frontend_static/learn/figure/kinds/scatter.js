/** Points, as opaque as their weights say. */

import { nearestOf } from "../polyline.js";
import { dots } from "../sheet.js";
import { named, saying } from "../words.js";

/** @import { Scatter } from "../types.js" */
/** @import { Hit, Sheet } from "../sheet.js" */

/** Weights are shown in so many steps: each is one path. */
const LEVELS = 12;
/** What weighs nothing can still be seen. */
const FAINTEST = 0.08;
/** Of so many points without weights each lets those below shine through. */
const [CROWDED, CROWDED_OPACITY] = [500, 0.45];

/**
 * @param {Sheet} sheet
 * @param {Scatter} scatter
 */
export function paint(sheet, scatter) {
  const { pen } = sheet;
  const [x, y] = [sheet.x.all(scatter.x), sheet.y.all(scatter.y)];
  pen.save();
  for (const [opacity, indices] of levels(sheet, scatter)) {
    pen.globalAlpha = opacity;
    dots(sheet, indices.map((index) => /** @type {const} */ ([x[index], y[index]])), scatter.ink, (scatter.size_px / 2) * sheet.unit);
  }
  pen.restore();
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
  return { ...scatter, x: [0.2, 0.5, 0.8], y: [0.3, 0.7, 0.4], weights: null, size_px: Math.max(5, scatter.size_px) };
}

/**
 * Numbers of the points that lie within the axes, by how opaque they are; the faintest first.
 *
 * @param {Sheet} sheet
 * @param {Scatter} scatter
 * @returns {[opacity: number, indices: number[]][]}
 */
function levels({ x, y }, scatter) {
  const { weights } = scatter;
  const isSeen = (/** @type {number} */ index) => {
    const [atX, atY] = [scatter.x[index], scatter.y[index]];
    return atX !== null && atY !== null && x.holds(atX) && y.holds(atY);
  };
  const seen = Array.from(scatter.x.keys()).filter(isSeen);
  if (weights === null) return [[seen.length > CROWDED ? CROWDED_OPACITY : 1, seen]];
  /** @type {number[][]} */
  const steps = Array.from({ length: LEVELS + 1 }, () => []);
  for (const index of seen) steps[Math.round(Math.min(Math.max(weights[index] ?? 0, 0), 1) * LEVELS)].push(index);
  return steps.map((indices, step) => [FAINTEST + (1 - FAINTEST) * (step / LEVELS), indices]);
}
