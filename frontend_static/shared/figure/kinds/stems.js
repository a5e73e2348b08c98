/** Lines from the ground up to points. */

import { paintPoints } from "../points.js";
import { nearestOf } from "../polyline.js";
import { stroke } from "../canvas.js";
import { named, saying } from "../description.js";

/** @import { Stems } from "../traces.js" */
/** @import { Hit, Sheet } from "../canvas.js" */

const HEAD = 3.2;
/** So many stems side by side have heads that can be told apart. */
const CROWDED = 1500;

/**
 * @param {Sheet} sheet
 * @param {Stems} stems
 */
export function paint(sheet, stems) {
  const [x, y] = [sheet.x.held(stems.x), sheet.y.all(stems.y)];
  const ground = sheet.y.at(sheet.y.ground);
  const path = new Path2D();
  for (const [at, top] of highest(x, y, ground)) {
    path.moveTo(at, ground);
    path.lineTo(at, top);
  }
  stroke(sheet, path, stems.ink, { solid: 1 });
  paintPoints(sheet, { x, y }, stems.ink, (x.length > CROWDED ? HEAD / 2 : HEAD) * sheet.unit);
}

/**
 * The stems that have to be drawn: of many that stand on one pixel the one that reaches furthest.
 *
 * @param {Float64Array} x px
 * @param {Float64Array} y px
 * @param {number} ground px
 * @returns {Iterable<readonly [x: number, top: number]>}
 */
function highest(x, y, ground) {
  /** @type {Map<number, readonly [x: number, top: number]>} */
  const found = new Map();
  for (let index = 0; index < x.length; index += 1) {
    if (!Number.isFinite(x[index] + y[index])) continue;
    const pixel = x.length > CROWDED ? Math.round(2 * x[index]) : index;
    const known = found.get(pixel);
    if (known === undefined || Math.abs(y[index] - ground) > Math.abs(known[1] - ground)) found.set(pixel, [x[index], y[index]]);
  }
  return found.values();
}

/**
 * @param {Sheet} sheet
 * @param {Stems} stems
 * @param {number} px
 * @param {number} py
 * @returns {Hit|null}
 */
export function near(sheet, stems, px, py) {
  const hit = nearestOf(sheet.x.all(stems.x), sheet.y.all(stems.y), px, py);
  if (hit === null) return null;
  const [x, y] = [Number(stems.x[hit.index]), Number(stems.y[hit.index])];
  return { ...hit, words: saying(stems, named(sheet.axes.x, x), named(sheet.axes.y, y)) };
}

/**
 * @param {Stems} stems
 * @returns {Stems} For the key.
 */
export function sample(stems) {
  return { ...stems, x: [0.2, 0.5, 0.8], y: [0.5, 0.85, 0.35] };
}
