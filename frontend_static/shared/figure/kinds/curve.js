/** A line through points, with a shaded area below a part of it. */

import { nearestOn, pathThrough } from "../polyline.js";
import { shade, stroke } from "../canvas.js";
import { named, saying } from "../description.js";

/** @import { Curve } from "../traces.js" */
/** @import { Hit, Sheet } from "../canvas.js" */

/**
 * @param {Sheet} sheet
 * @param {Curve} curve
 */
export function paint(sheet, curve) {
  const [x, y] = [sheet.x.all(curve.x), sheet.y.all(curve.y)];
  if (curve.area !== null) shade(sheet, below(sheet, x, y, curve.area), curve.ink);
  stroke(sheet, pathThrough(x, y), curve.ink, curve);
}

/**
 * @param {Sheet} sheet
 * @param {Curve} curve
 * @param {number} px
 * @param {number} py
 * @returns {Hit|null}
 */
export function near(sheet, curve, px, py) {
  const hit = nearestOn(sheet.x.all(curve.x), sheet.y.all(curve.y), px, py);
  if (hit === null) return null;
  const words = saying(curve, named(sheet.axes.x, sheet.x.value(hit.x)), named(sheet.axes.y, sheet.y.value(hit.y)));
  return { ...hit, words };
}

/**
 * @param {Curve} curve
 * @returns {Curve} For the key.
 */
export function sample(curve) {
  return { ...curve, x: [0, 1], y: [0.5, 0.5], area: curve.area && [0, 1] };
}

/**
 * What lies between the curve and the ground, from one value to another; in pieces where the curve has gaps.
 *
 * @param {Sheet} sheet
 * @param {Float64Array} x px
 * @param {Float64Array} y px
 * @param {[number, number]} area
 */
function below(sheet, x, y, area) {
  const [from, to] = area.map((value) => sheet.x.at(value)).sort((one, other) => one - other);
  const ground = sheet.y.at(sheet.y.ground);
  const path = new Path2D();
  for (let index = 0; index + 1 < x.length; index += 1) {
    const [a, b] = x[index] <= x[index + 1] ? [index, index + 1] : [index + 1, index];
    const [left, right] = [Math.max(x[a], from), Math.min(x[b], to)];
    if (!(left < right) || !Number.isFinite(y[a] + y[b])) continue;
    const height = (/** @type {number} */ at) => y[a] + ((at - x[a]) / (x[b] - x[a])) * (y[b] - y[a]);
    path.moveTo(left, ground);
    path.lineTo(left, height(left));
    path.lineTo(right, height(right));
    path.lineTo(right, ground);
    path.closePath();
  }
  return path;
}
