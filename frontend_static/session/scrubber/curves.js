/**
 * The curves of the scrubber. Longer runs than there are pixels are drawn with the largest value of each pixel, so no peak
 * is lost.
 */

import { rowOf } from "./rows.js";

/** @import { ThresholdStep } from "../../shared/messages.js" */
/** @import { Curve, History } from "../history.js" */
/** @import { Sheet } from "./rows.js" */

/** @typedef {{history: History, colour: string, active: boolean}} Line The curves of a branch. */
/** @typedef {{row: "error"|"sigma", history: History, value: Curve, most: number}} Trace A curve, and the value at the top of its row. */

/**
 * The value at the top of a row.
 *
 * @param {Line[]} lines
 * @param {Curve} value
 * @param {number} smallest The least that it is.
 */
export function top(lines, value, smallest) {
  return Math.max(smallest, ...lines.map(({ history }) => history.most(value) ?? 0)) * 1.05;
}

/**
 * One curve of all branches, that of the active one on top and in a width of its own.
 *
 * @param {Sheet} sheet
 * @param {Line[]} others
 * @param {Line} own
 * @param {Omit<Trace, "history"> & {width: number}} look
 */
export function curves(sheet, others, own, { width, ...trace }) {
  for (const { history, colour } of others) line(sheet, { ...trace, history }, colour, 1);
  line(sheet, { ...trace, history: own.history }, own.colour, width);
}

/**
 * Lay the path of a curve.
 *
 * @param {Sheet} sheet
 * @param {Trace} trace
 * @returns {number} Where it ends, along x.
 */
function path(sheet, { row, history, value, most }) {
  const { context, axis } = sheet;
  const [, y, height] = rowOf(sheet, row);
  const bucket = Math.max(1, Math.floor(history.length / axis.width));
  let drawing = false;
  let lastX = axis.left;
  context.beginPath();
  for (let frame = 0; frame < history.length; frame += bucket) {
    const number = history.most(value, frame, Math.min(frame + bucket, history.length) - 1);
    if (number === null) {
      drawing = false;
      continue;
    }
    lastX = axis.x(frame);
    const at = y + height - Math.min(1, number / most) * (height - 2) - 1;
    if (drawing) context.lineTo(lastX, at);
    else context.moveTo(lastX, at);
    drawing = true;
  }
  return lastX;
}

/**
 * @param {Sheet} sheet
 * @param {Trace} trace
 * @param {string} colour
 * @param {number} width
 */
function line(sheet, trace, colour, width) {
  const { context } = sheet;
  path(sheet, trace);
  context.strokeStyle = colour;
  context.lineWidth = width;
  context.lineJoin = "round";
  context.stroke();
}

/**
 * @param {Sheet} sheet
 * @param {Trace} trace
 * @param {string} colour
 */
export function area(sheet, trace, colour) {
  const { context, axis } = sheet;
  const [, y, height] = rowOf(sheet, trace.row);
  if (trace.history.most(trace.value) === null) return;
  const end = path(sheet, trace);
  context.lineTo(end, y + height);
  context.lineTo(axis.left, y + height);
  context.globalAlpha = 0.16;
  context.fillStyle = colour;
  context.fill();
  context.globalAlpha = 1;
}

/**
 * @param {Sheet} sheet
 * @param {ThresholdStep[]} steps
 * @param {number} most
 */
export function threshold(sheet, steps, most) {
  const { context, axis, ink } = sheet;
  const [, y, height] = rowOf(sheet, "sigma");
  context.strokeStyle = ink.ink;
  context.lineWidth = 1;
  context.setLineDash([4, 3]);
  context.beginPath();
  steps.forEach(({ frame, value }, index) => {
    if (value === null) return;
    const at = Math.round(y + height - Math.min(1, value / most) * (height - 2)) - 0.5;
    context.moveTo(axis.x(frame), at);
    context.lineTo(axis.x(steps[index + 1]?.frame ?? axis.frames - 1), at);
  });
  context.stroke();
  context.setLineDash([]);
}
