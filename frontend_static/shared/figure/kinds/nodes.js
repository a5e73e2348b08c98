/** Discs as opaque as they say, or rings around what is chosen. */

import { byOpacity, colourOf } from "../canvas.js";

/** @import { Sheet } from "../canvas.js" */
/** @import { Nodes } from "../traces.js" */

const RING = 2;

/**
 * @param {Sheet} sheet
 * @param {Nodes} nodes
 */
export function paint(sheet, { x, y, opacity, ink, size_px: size, ring }) {
  const { pen, unit } = sheet;
  const [left, top] = [sheet.x.all(x), sheet.y.all(y)];
  const radius = (size / 2) * unit;
  const groups = byOpacity(opacity, (index, path) => {
    if (!Number.isFinite(left[index] + top[index])) return;
    path.moveTo(left[index] + radius, top[index]);
    path.arc(left[index], top[index], radius, 0, 2 * Math.PI);
  });
  pen.save();
  pen.fillStyle = pen.strokeStyle = colourOf(sheet, ink);
  pen.lineWidth = RING * unit;
  for (const [share, path] of groups) {
    pen.globalAlpha = share;
    if (ring) pen.stroke(path);
    else pen.fill(path);
  }
  pen.restore();
}

/** What a node means is said beside the plot. */
export function near() {
  return null;
}

/**
 * @param {Nodes} nodes
 * @returns {Nodes}
 */
export function sample(nodes) {
  return { ...nodes, x: [0.5], y: [0.5], opacity: [1] };
}
