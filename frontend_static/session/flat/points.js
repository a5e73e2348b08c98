/** Painting clouds of points: discs, or stamps of whole pixels where there are thousands. */

import { css, placed } from "./pixels.js";

/** @import { Points } from "./decode.js" */
/** @import { Surface } from "./paint.js" */

const STAMPED_FROM = 2000;
const OPAQUE = 0xff000000;

/**
 * @param {Surface} surface
 * @param {Points} item
 */
export function paintPoints(surface, item) {
  const radius = Math.max(0.5 * surface.density, (item.size * surface.scale) / 2);
  if (item.positions.length / 3 >= STAMPED_FROM) stamp(surface, item, radius);
  else discs(surface, item, radius);
}

/**
 * Points of one colour that follow each other are one path.
 *
 * @param {Surface} surface
 * @param {Points} item
 * @param {number} radius
 */
function discs({ context, width, height, scale }, { positions, colours }, radius) {
  let shown = -1;
  context.beginPath();
  for (let at = 0; at < positions.length; at += 3) {
    const x = placed(positions[at], scale);
    const y = placed(positions[at + 1], scale);
    if (!(x > -radius && x < width + radius && y > -radius && y < height + radius)) continue;
    const colour = (colours[at] << 16) | (colours[at + 1] << 8) | colours[at + 2];
    if (colour !== shown) {
      context.fill();
      context.beginPath();
      context.fillStyle = css(colours.subarray(at, at + 3));
      shown = colour;
    }
    context.moveTo(x + radius, y);
    context.arc(x, y, radius, 0, 2 * Math.PI);
  }
  context.fill();
}

/**
 * Set the pixels around each point in an image of the cloud's extent, which is then laid over the canvas.
 *
 * @param {Surface} surface
 * @param {Points} item
 * @param {number} radius
 */
function stamp({ context, width, height, scale }, { positions, colours }, radius) {
  const reach = Math.max(0, Math.round(radius - 0.5));
  const [left, top, right, bottom] = extent(positions, scale, reach, width, height);
  if (right <= left || bottom <= top) return;
  const [wide, high] = [right - left, bottom - top];
  const image = new ImageData(wide, high);
  const pixels = new Uint32Array(image.data.buffer);
  const brush = offsets(reach);
  for (let at = 0; at < positions.length; at += 3) {
    const x = Math.floor(placed(positions[at], scale)) - left;
    const y = Math.floor(placed(positions[at + 1], scale)) - top;
    const colour = OPAQUE | (colours[at + 2] << 16) | (colours[at + 1] << 8) | colours[at];
    for (const [dx, dy] of brush) {
      if (x + dx >= 0 && x + dx < wide && y + dy >= 0 && y + dy < high) pixels[(y + dy) * wide + x + dx] = colour;
    }
  }
  const layer = new OffscreenCanvas(wide, high);
  layer.getContext("2d")?.putImageData(image, 0, 0);
  context.drawImage(layer, left, top);
}

/**
 * The part of the canvas that a cloud covers: left, top, right, bottom in its pixels.
 *
 * @param {Float32Array} positions
 * @param {number} scale
 * @param {number} reach
 * @param {number} width
 * @param {number} height
 */
function extent(positions, scale, reach, width, height) {
  let [left, top, right, bottom] = [width, height, 0, 0];
  for (let at = 0; at < positions.length; at += 3) {
    const x = Math.floor(placed(positions[at], scale));
    const y = Math.floor(placed(positions[at + 1], scale));
    if (!Number.isFinite(x + y)) continue;
    left = Math.min(left, x - reach);
    top = Math.min(top, y - reach);
    right = Math.max(right, x + reach + 1);
    bottom = Math.max(bottom, y + reach + 1);
  }
  return [Math.max(left, 0), Math.max(top, 0), Math.min(right, width), Math.min(bottom, height)];
}

/**
 * The pixels of a disc about its middle.
 *
 * @param {number} reach
 * @returns {[number, number][]}
 */
function offsets(reach) {
  /** @type {[number, number][]} */
  const found = [];
  for (let dy = -reach; dy <= reach; dy += 1) {
    for (let dx = -reach; dx <= reach; dx += 1) if (dx * dx + dy * dy <= reach * reach) found.push([dx, dy]);
  }
  return found;
}
