/** Adjoining bars over intervals. */

import { REACH, shade, stroke } from "../canvas.js";
import { named, saying, valueOn } from "../description.js";

/** @import { Histogram } from "../traces.js" */
/** @import { Hit, Sheet } from "../canvas.js" */

/**
 * @param {Sheet} sheet
 * @param {Histogram} histogram
 */
export function paint(sheet, { edges, heights, ink }) {
  const [x, y] = [sheet.x.all(edges), sheet.y.all(heights)];
  const ground = sheet.y.at(sheet.y.ground);
  const bars = new Path2D();
  const outline = new Path2D();
  heights.forEach((_, index) => {
    if (!Number.isFinite(y[index])) return;
    bars.rect(x[index], y[index], x[index + 1] - x[index], ground - y[index]);
    const before = Number.isFinite(y[index - 1]) ? y[index - 1] : ground;
    outline.moveTo(x[index], Math.max(before, ground));
    outline.lineTo(x[index], y[index]);
    outline.lineTo(x[index + 1], y[index]);
    outline.lineTo(x[index + 1], ground);
  });
  shade(sheet, bars, ink);
  stroke(sheet, outline, ink, { solid: 1 });
}

/**
 * @param {Sheet} sheet
 * @param {Histogram} histogram
 * @param {number} px
 * @param {number} py
 * @returns {Hit|null}
 */
export function near(sheet, histogram, px, py) {
  const { edges, heights } = histogram;
  const ground = sheet.y.at(sheet.y.ground);
  const index = heights.findIndex((height, bar) => {
    const [left, right, top] = [sheet.x.at(edges[bar]), sheet.x.at(edges[bar + 1]), sheet.y.at(height)];
    return px >= left && px < right && py >= Math.min(top, ground) && py <= Math.max(top, ground);
  });
  const [height, from, to] = [heights[index], edges[index], edges[index + 1]];
  if (index < 0 || height === null || from === null || to === null) return null;
  const { x, y } = sheet.axes;
  const words = saying(histogram, `${x.title} ${valueOn(x, from)} to ${valueOn(x, to)}`.trim(), named(y, height));
  return { distance: REACH * sheet.unit, x: sheet.x.at((from + to) / 2), y: sheet.y.at(height), words };
}

/**
 * @param {Histogram} histogram
 * @returns {Histogram} For the key.
 */
export function sample(histogram) {
  return { ...histogram, edges: [0, 1 / 3, 2 / 3, 1], heights: [0.4, 1, 0.7] };
}
