/** What a map is drawn with besides its cells. */

/** @import { AxisPublic } from "../shared/messages.js" */
/** @import { Value } from "../shared/format.js" */

/** @typedef {[x: number, y: number, width: number, height: number]} Box px of the page. */

/**
 * "Occluder width, px"
 *
 * @param {AxisPublic} axis
 */
export function titled({ title, unit }) {
  return unit ? `${title}, ${unit}` : title;
}

/**
 * A value of an axis, short.
 *
 * @param {Value} value
 */
export function short(value) {
  return typeof value === "number" ? String(Number(value.toPrecision(4))) : String(value);
}

/**
 * Lines across a rectangle, for what was not tested.
 *
 * @param {CanvasRenderingContext2D} pen
 * @param {Box} box
 * @param {string} colour
 */
export function hatch(pen, [x, y, width, height], colour) {
  pen.save();
  pen.beginPath();
  pen.rect(x, y, width, height);
  pen.clip();
  pen.strokeStyle = colour;
  pen.lineWidth = 1;
  pen.beginPath();
  for (let d = -height; d < width; d += 5) {
    pen.moveTo(x + d, y + height);
    pen.lineTo(x + d + height, y);
  }
  pen.stroke();
  pen.strokeRect(x + 0.5, y + 0.5, width - 1, height - 1);
  pen.restore();
}

/**
 * Every nth of so many places, the first always.
 *
 * @param {number} count
 * @param {number} step
 */
export function sparse(count, step) {
  return Array.from({ length: Math.ceil(count / step) }, (_, index) => index * step);
}

/**
 * The nearest of the numbers 0..count-1.
 *
 * @param {number} value
 * @param {number} count
 */
export function clamp(value, count) {
  return Math.min(Math.max(value, 0), count - 1);
}
