/** Lines from the ground up to points. */

import { nearestOf } from "../polyline.js";
import { dots, stroke } from "../sheet.js";
import { named, saying } from "../words.js";

/** @import { Stems } from "../types.js" */
/** @import { Hit, Sheet } from "../sheet.js" */

const HEAD = 3.2;
/** So many stems side by side have heads that can be told apart. */
const CROWDED = 2000;

/**
 * @param {Sheet} sheet
 * @param {Stems} stems
 */
export function paint(sheet, stems) {
  const [x, y] = [sheet.x.all(stems.x), sheet.y.all(stems.y)];
  const ground = sheet.y.at(sheet.y.ground);
  const path = new Path2D();
  x.forEach((at, index) => {
    if (!Number.isFinite(at + y[index])) return;
    path.moveTo(at, ground);
    path.lineTo(at, y[index]);
  });
  stroke(sheet, path, stems.ink, { solid: 1 });
  const radius = (x.length > CROWDED ? HEAD / 2 : HEAD) * sheet.unit;
  const isSeen = (/** @type {number} */ index) => Number.isFinite(x[index] + y[index]) && sheet.x.holds(Number(stems.x[index]));
  const heads = Array.from(x.keys()).filter(isSeen);
  dots(sheet, heads.map((index) => /** @type {const} */ ([x[index], y[index]])), stems.ink, radius);
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
