/**
 * Painting the memory of the run: error, sigma against its thresholds, ESS, proposals, bands and marks, in rows over one
 * axis of frames. Longer runs than there are pixels are drawn with the largest value of each pixel, so no peak is lost.
 */

import { curve, isGone } from "../history.js";

/**
 * Rows from top to bottom: label, top, height, CSS px.
 *
 * @type {Record<"flags"|"error"|"sigma"|"ess"|"proposal"|"bands"|"changes", [string, number, number]>}
 */
export const ROWS = {
  flags: ["", 0, 12],
  error: ["error", 12, 34],
  sigma: ["sigma", 50, 24],
  ess: ["ESS", 78, 6],
  proposal: ["proposal", 88, 8],
  bands: ["hidden, lost", 100, 10],
  changes: ["changes", 112, 16],
};
export const HEIGHT = 130;
export const GUTTER = 104;
const MARGIN = 10;

/** Where frames lie along x. */
export class Axis {
  constructor(width, frames) {
    this.left = GUTTER;
    this.width = Math.max(1, width - GUTTER - MARGIN);
    this.frames = Math.max(2, frames);
  }

  x(frame) {
    return this.left + (frame / (this.frames - 1)) * this.width;
  }

  frame(x) {
    const frame = Math.round(((x - this.left) / this.width) * (this.frames - 1));
    return Math.min(Math.max(0, frame), this.frames - 1);
  }
}

/**
 * Paint all but the playhead.
 *
 * @param {CanvasRenderingContext2D} context Scaled to CSS px.
 * @param {Axis} axis
 * @param {object} view {lines: [{history, colour, active}], thresholds, bookmarks, marks, smallest, weight, mixture}:
 *     `smallest` is the least that an axis spans; `weight` gives of a row the share of the particles that carry the
 *     weight, and `mixture` is {label, shares}, of a row [colour, share] for each sampler; null where there is none;
 *     `missing` are the rows that nothing is known for
 * @param {object} ink Colours by token.
 */
export function paint(context, axis, view, ink) {
  context.clearRect(0, 0, context.canvas.width, context.canvas.height);
  labels(context, axis, view, ink);
  const chosen = view.lines.find(({ active }) => active);
  if (!chosen) return;
  const { history: own, colour: ownColour } = chosen;
  const others = view.lines.filter(({ active }) => !active);

  bands(context, axis, own, ink);
  const errorTop = top(view.lines, curve.error, view.smallest);
  area(context, axis, "error", own, curve.error, errorTop, ownColour);
  for (const { history, colour } of others) line(context, axis, "error", history, curve.error, errorTop, colour, 1);
  line(context, axis, "error", own, curve.error, errorTop, ownColour, 1.6);

  const gammas = view.thresholds.flatMap(({ steps }) => steps.map(({ value }) => value ?? 0));
  const sigmaTop = Math.max(top(view.lines, curve.sigma, view.smallest), ...gammas.map((value) => value * 1.25));
  for (const { history, colour } of others) line(context, axis, "sigma", history, curve.sigma, sigmaTop, colour, 1);
  line(context, axis, "sigma", own, curve.sigma, sigmaTop, ownColour, 1.4);
  for (const { steps } of view.thresholds) threshold(context, axis, steps, sigmaTop, ink.ink);

  strips(context, axis, own, view, ink);
  marks(context, axis, view.marks, ink);
  flags(context, axis, view.bookmarks, ink);
}

function labels(context, axis, view, ink) {
  const own = { sigma: view.thresholds.length > 0 ? "sigma | limit" : "sigma", proposal: view.mixture.label };
  context.font = "11px system-ui, sans-serif";
  context.textBaseline = "middle";
  context.textAlign = "right";
  for (const [name, [label, y, height]] of Object.entries(ROWS)) {
    if (view.missing.includes(name)) continue;
    context.fillStyle = ink.muted;
    context.fillText(own[name] ?? label, axis.left - 12, y + height / 2);
    if (name === "flags" || name === "changes") continue;
    context.fillStyle = ink.well;
    context.fillRect(axis.left, y, axis.width, height);
  }
}

function top(lines, value, smallest) {
  return Math.max(smallest, ...lines.map(({ history }) => history.most(value) ?? 0)) * 1.05;
}

function trace(context, axis, row, history, value, most) {
  const [, y, height] = ROWS[row];
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

function line(context, axis, row, history, value, most, colour, width) {
  trace(context, axis, row, history, value, most);
  context.strokeStyle = colour;
  context.lineWidth = width;
  context.lineJoin = "round";
  context.stroke();
}

function area(context, axis, row, history, value, most, colour) {
  const [, y, height] = ROWS[row];
  if (history.most(value) === null) return;
  const end = trace(context, axis, row, history, value, most);
  context.lineTo(end, y + height);
  context.lineTo(axis.left, y + height);
  context.globalAlpha = 0.16;
  context.fillStyle = colour;
  context.fill();
  context.globalAlpha = 1;
}

function threshold(context, axis, steps, most, colour) {
  const [, y, height] = ROWS.sigma;
  context.strokeStyle = colour;
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

function bands(context, axis, history, ink) {
  const [, y, height] = ROWS.bands;
  const half = axis.width / (axis.frames - 1) / 2;
  const band = ([first, last], from, tall, colour, alpha) => {
    const left = Math.max(axis.left, axis.x(first) - half);
    const right = Math.min(axis.left + axis.width, axis.x(last) + half);
    context.globalAlpha = alpha;
    context.fillStyle = colour;
    context.fillRect(left, from, Math.max(1, right - left), tall);
    context.globalAlpha = 1;
  };
  for (const span of history.spans((row) => row?.hidden === true)) {
    band(span, ROWS.error[1], ROWS.sigma[1] + ROWS.sigma[2] - ROWS.error[1], ink.hidden, 0.2);
    band(span, y, height, ink.hidden, 0.55);
  }
  for (const span of history.spans(isGone)) band(span, y + 2, height - 4, ink.lost, 1);
}

function strips(context, axis, history, { weight, mixture }, ink) {
  const [, essY, essHeight] = ROWS.ess;
  const [, y, height] = ROWS.proposal;
  const bucket = Math.max(1, Math.floor(history.length / axis.width));
  const step = (axis.width / (axis.frames - 1)) * bucket;
  for (let frame = 0; frame < history.length; frame += bucket) {
    const row = history.at(frame);
    const left = Math.max(axis.left, axis.x(frame) - step / 2);
    const width = Math.min(axis.x(frame) + step / 2, axis.left + axis.width) - left + 0.3;
    const carrying = weight(row);
    if (carrying !== null) {
      context.fillStyle = ink.ramp;
      context.globalAlpha = Math.min(1, 0.08 + 0.92 * carrying);
      context.fillRect(left, essY, width, essHeight);
      context.globalAlpha = 1;
    }
    let bottom = y + height;
    for (const [colour, share] of mixture.shares(row) ?? []) {
      context.fillStyle = ink[colour];
      context.fillRect(left, bottom - share * height, width, share * height);
      bottom -= share * height;
    }
  }
}

function marks(context, axis, changes, ink) {
  const [, y, height] = ROWS.changes;
  context.textAlign = "left";
  let free = 0;
  changes.forEach(({ frame, lines }, index) => {
    const x = axis.x(frame);
    diamond(context, x, y + height / 2, 5, ink.ink);
    const text = lines.length > 1 ? `${lines[0]}, …` : lines[0];
    const room = (index + 1 < changes.length ? axis.x(changes[index + 1].frame) - 8 : axis.left + axis.width) - x - 9;
    if (x > free && text && context.measureText(text).width <= room) {
      context.fillStyle = ink.ink;
      context.fillText(text, x + 9, y + height / 2 + 0.5);
      free = x + 9 + context.measureText(text).width;
    }
  });
}

function diamond(context, x, y, size, colour) {
  context.fillStyle = colour;
  context.beginPath();
  context.moveTo(x, y - size);
  context.lineTo(x + size, y);
  context.lineTo(x, y + size);
  context.lineTo(x - size, y);
  context.fill();
}

function flags(context, axis, bookmarks, ink) {
  for (const { frame } of bookmarks) {
    const x = Math.round(axis.x(frame)) + 0.5;
    context.fillStyle = ink.accent;
    context.beginPath();
    context.moveTo(x - 4, 0);
    context.lineTo(x + 4, 0);
    context.lineTo(x + 4, 11);
    context.lineTo(x, 7.5);
    context.lineTo(x - 4, 11);
    context.fill();
  }
}

/** Paint where the run stands: a line through all rows with a grip on top. */
export function playhead(context, axis, position, computed, ink) {
  const x = Math.round(axis.x(position)) + 0.5;
  const [, y, height] = ROWS.bands;
  context.strokeStyle = ink.ink;
  context.lineWidth = 1.5;
  context.beginPath();
  context.moveTo(x, 6);
  context.lineTo(x, y + height);
  context.stroke();
  context.fillStyle = ink.ink;
  context.strokeStyle = ink.surface;
  context.beginPath();
  context.arc(x, 6, 5, 0, 2 * Math.PI);
  context.fill();
  context.stroke();
  if (computed > position) {
    context.fillStyle = ink.muted;
    context.fillRect(axis.x(computed) - 0.5, 12, 1, y + height - 12);
  }
}
