/** A picture behind what is drawn in the panel. */

import { decoded } from "../pictures.js";

/** @import { Picture } from "../traces.js" */
/** @import { Sheet } from "../canvas.js" */

/**
 * @param {Sheet} sheet
 * @param {Picture} picture
 */
export function paint({ pen, x, y }, { png, width, height }) {
  const bitmap = decoded(png);
  if (bitmap === undefined) return;
  const [left, top] = [x.at(0), y.at(0)];
  const [wide, high] = [x.at(width) - left, y.at(height) - top];
  pen.save();
  // Each pixel of an enlarged picture stays a square: that is what the tracker sees.
  pen.imageSmoothingEnabled = wide < bitmap.width;
  pen.drawImage(bitmap, left, top, wide, high);
  pen.restore();
}

/** Nothing is said of its pixels. */
export function near() {
  return null;
}

/**
 * @param {Picture} picture
 * @returns {Picture} For the key.
 */
export function sample(picture) {
  return { ...picture, width: 1, height: 1 };
}
