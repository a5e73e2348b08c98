/** What lies between two lines, such as two standard deviations around an estimate. */

import { ALONE, kept } from "../polyline.js";
import { tint } from "../canvas.js";

/** @import { Sheet } from "../canvas.js" */
/** @import { Band } from "../traces.js" */

/**
 * @param {Sheet} sheet
 * @param {Band} band
 */
export function paint(sheet, band) {
  const x = sheet.x.all(band.x);
  const [low, high] = [sheet.y.all(band.low), sheet.y.all(band.high)];
  const path = new Path2D();
  for (const piece of pieces(x, low, high)) {
    if (piece[1] === piece[0] + 1) {
      const [at] = piece;
      path.rect(x[at] - ALONE, Math.min(low[at], high[at]), 2 * ALONE, Math.abs(high[at] - low[at]));
      continue;
    }
    const [above, below] = [high, low].map((edge) => kept(x.subarray(...piece), edge.subarray(...piece)).map((index) => index + piece[0]));
    above.forEach((index, place) => (place === 0 ? path.moveTo(x[index], high[index]) : path.lineTo(x[index], high[index])));
    for (const index of below.reverse()) path.lineTo(x[index], low[index]);
    path.closePath();
  }
  tint(sheet, path, band);
}

/** A band is read by the line in it. */
export function near() {
  return null;
}

/**
 * @param {Band} band
 * @returns {Band}
 */
export function sample(band) {
  return { ...band, x: [0, 1], low: [0.2, 0.2], high: [0.8, 0.8] };
}

/**
 * Where both edges are known: from one index up to another.
 *
 * @param {Float64Array} x
 * @param {Float64Array} low
 * @param {Float64Array} high
 */
function pieces(x, low, high) {
  /** @type {[from: number, to: number][]} */
  const found = [];
  let from = -1;
  for (let index = 0; index <= x.length; index += 1) {
    const isKnown = index < x.length && Number.isFinite(x[index] + low[index] + high[index]);
    if (isKnown && from < 0) from = index;
    if (!isKnown && from >= 0) {
      found.push([from, index]);
      from = -1;
    }
  }
  return found;
}
