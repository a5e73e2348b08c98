/** Words at a point, with a rim that parts them from what lies behind. */

/** @import { Label } from "../traces.js" */
/** @import { Sheet } from "../canvas.js" */

const SIZE = 13;
const RIM = 4;

/**
 * @param {Sheet} sheet
 * @param {Label} label
 */
export function paint(sheet, { title, x, y }) {
  const { pen, box, unit } = sheet;
  pen.save();
  pen.font = `600 ${SIZE * unit}px ${getComputedStyle(pen.canvas).fontFamily}`;
  pen.textBaseline = "middle";
  pen.textAlign = "center";
  // Words at an edge stay within the box.
  const half = pen.measureText(title).width / 2 + RIM * unit;
  const atX = Math.min(Math.max(sheet.x.at(x), box.left + half), Math.max(box.left + box.width - half, box.left + half));
  const high = SIZE * unit;
  const atY = Math.min(Math.max(sheet.y.at(y), box.top + high / 2), box.top + box.height - high / 2);
  pen.lineJoin = "round";
  pen.lineWidth = RIM * unit;
  pen.strokeStyle = sheet.ink.surface;
  pen.strokeText(title, atX, atY);
  // Words in the paler colours could not be read.
  pen.fillStyle = sheet.ink.ink;
  pen.fillText(title, atX, atY);
  pen.restore();
}

/** It says itself what it is. */
export function near() {
  return null;
}

/**
 * @param {Label} label
 * @returns {Label} It needs no key.
 */
export function sample(label) {
  return label;
}
