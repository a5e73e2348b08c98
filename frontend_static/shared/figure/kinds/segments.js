/** Lines from point to point, each as opaque as it says: hypotheses from frame to frame. */

import { byOpacity, line } from "../canvas.js";

/** @import { Sheet } from "../canvas.js" */
/** @import { Segments } from "../traces.js" */

const WIDTH = 1.8;

/**
 * @param {Sheet} sheet
 * @param {Segments} segments
 */
export function paint(sheet, { x0, y0, x1, y1, opacity, ink }) {
  const [left, top, right, bottom] = [sheet.x.all(x0), sheet.y.all(y0), sheet.x.all(x1), sheet.y.all(y1)];
  const groups = byOpacity(opacity, (index, path) => {
    if (!Number.isFinite(left[index] + top[index] + right[index] + bottom[index])) return;
    path.moveTo(left[index], top[index]);
    path.lineTo(right[index], bottom[index]);
  });
  for (const [share, path] of groups) line(sheet, path, { ink, width: WIDTH, opacity: share });
}

/** A segment is read at its nodes. */
export function near() {
  return null;
}

/**
 * @param {Segments} segments
 * @returns {Segments}
 */
export function sample(segments) {
  return { ...segments, x0: [0], y0: [0.5], x1: [1], y1: [0.5], opacity: [1] };
}
