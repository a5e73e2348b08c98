/** From a drawing's numbers to a canvas's. */

/** Beyond so many pixels of the canvas nothing is told apart, and browsers grow slow. */
const FAR_PX = 30_000;

/**
 * Where a coordinate lands on the canvas; what is not a number stays so.
 *
 * @param {number} value px of the drawing, from the centre of the first pixel
 * @param {number} scale Pixels of the canvas per px of the drawing.
 */
export function placed(value, scale) {
  return Math.min(Math.max(scale * (value + 0.5), -FAR_PX), FAR_PX);
}

/** @param {ArrayLike<number>} colour RGB, 0 to 255 */
export function css(colour) {
  return `rgb(${colour[0]} ${colour[1]} ${colour[2]})`;
}
