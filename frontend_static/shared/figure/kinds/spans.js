/** Intervals in which something held, shaded behind what is drawn. */

import { tint } from "../canvas.js";

/** @import { Sheet } from "../canvas.js" */
/** @import { Spans } from "../traces.js" */

/**
 * @param {Sheet} sheet
 * @param {Spans} spans
 */
export function paint(sheet, spans) {
  const { box, x, y } = sheet;
  const path = new Path2D();
  for (const { first, last, low, high } of spans.intervals) {
    const [left, right] = [x.at(first), x.at(last)];
    const [top, bottom] = low === undefined || high === undefined ? [box.top, box.top + box.height] : [y.at(low), y.at(high)];
    path.rect(left, Math.min(top, bottom), Math.max(1, right - left), Math.abs(bottom - top));
  }
  tint(sheet, path, spans);
}

/** What a shade means is said beside the plot. */
export function near() {
  return null;
}

/**
 * @param {Spans} spans
 * @returns {Spans}
 */
export function sample(spans) {
  return { ...spans, intervals: [{ first: 0, last: 1 }] };
}
