/** Names of what is drawn, for whoever points at it. */

/** @import { Primitive } from "./decode.js" */

/** So near the pointer has to be, in pixels of the page. */
const REACH = 9;

/**
 * The written-out name of what a pointer is at: the nearest point that has one, whether its label is shown or not.
 *
 * @param {readonly Primitive[]} primitives
 * @param {number} x px of the drawing, from the centre of its first pixel
 * @param {number} y
 * @param {number} scale Pixels of the page per px of the drawing.
 * @returns {string} Empty where nothing is.
 */
export function nameAt(primitives, x, y, scale) {
  let [name, nearest] = ["", REACH / scale];
  for (const item of primitives) {
    if (item.kind !== "text" || item.title === "" || item.point === null) continue;
    const distance = Math.hypot(item.point[0] - x, item.point[1] - y);
    if (distance <= nearest) [name, nearest] = [item.title, distance];
  }
  return name;
}
