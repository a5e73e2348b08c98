/**
 * Painting the memory of the run: error, sigma against its thresholds, ESS, proposals, bands and marks, in rows over one
 * axis of frames.
 */

import { curve, isGone } from "../history.js";
import { area, curves, threshold, top } from "./curves.js";
import { rowOf } from "./rows.js";

/** @import { Bookmark, ThresholdPublic } from "../../shared/messages.js" */
/** @import { Curve, History, Row } from "../history.js" */
/** @import { Mark } from "../timeline.js" */
/** @import { Line } from "./curves.js" */
/** @import { RowName, Sheet } from "./rows.js" */

/** @typedef {{lanes: number, of: (row: Row|undefined) => {colour: string, lane: number}[]}} Events What happened in a frame; colours by token. */
/** @typedef {{label: string, shares: (row: Row|undefined) => {colour: string, share: number}[]}} Mixture Of samplers; colours by token. */

/**
 * What there is to paint.
 *
 * @typedef {object} Content
 * @property {Line[]} lines
 * @property {ThresholdPublic[]} thresholds
 * @property {Bookmark[]} bookmarks
 * @property {Mark[]} marks
 * @property {number} smallest The least that an axis spans.
 * @property {Curve} weight The share of the particles that carries the weight.
 * @property {Mixture} mixture
 * @property {Events} events
 * @property {{history: History, colour: string}[]} losses Of several runs, in whose colours their losses are shown, a lane each.
 * @property {string} gone What the row of bands is called, by what is known: "hidden", "lost" or both.
 */

/**
 * Paint all but the playhead.
 *
 * @param {Sheet} sheet
 * @param {Content} content
 */
export function paint(sheet, content) {
  const { canvas } = sheet.context;
  sheet.context.clearRect(0, 0, canvas.width, canvas.height);
  labels(sheet, content);
  const own = content.lines.find(({ active }) => active);
  if (!own) return;
  bands(sheet, own.history, content.losses);
  const others = content.lines.filter((line) => line !== own);
  const errorTop = top(content.lines, curve.error, content.smallest);
  area(sheet, { row: "error", history: own.history, value: curve.error, most: errorTop }, own.colour);
  curves(sheet, others, own, { row: "error", value: curve.error, most: errorTop, width: 1.6 });
  const limits = content.thresholds.flatMap(({ steps }) => steps.map(({ value }) => 1.25 * (value ?? 0)));
  const sigmaTop = Math.max(top(content.lines, curve.sigma, content.smallest), ...limits);
  curves(sheet, others, own, { row: "sigma", value: curve.sigma, most: sigmaTop, width: 1.4 });
  for (const { steps } of content.thresholds) threshold(sheet, steps, sigmaTop);
  strips(sheet, own.history, content);
  ticks(sheet, own.history, content.events);
  marks(sheet, content.marks);
  flags(sheet, content.bookmarks);
}

/**
 * @param {Sheet} sheet
 * @param {Content} content
 */
function labels({ context, axis, ink, rows }, { thresholds, mixture, gone }) {
  /** @type {Partial<Record<RowName, string>>} */
  const own = { sigma: thresholds.length > 0 ? "sigma | limit" : "sigma", proposal: mixture.label, bands: gone };
  context.font = "11px system-ui, sans-serif";
  context.textBaseline = "middle";
  context.textAlign = "right";
  for (const [name, [label, y, height]] of /** @type {[RowName, [string, number, number]][]} */ (Object.entries(rows))) {
    context.fillStyle = ink.muted;
    context.fillText(own[name] ?? label, axis.left - 12, y + height / 2);
    if (name === "flags" || name === "changes") continue;
    context.fillStyle = ink.well;
    context.fillRect(axis.left, y, axis.width, height);
  }
}

/**
 * @param {Sheet} sheet
 * @param {History} history
 * @param {Content["losses"]} losses
 */
function bands(sheet, history, losses) {
  const { ink } = sheet;
  const [, y, height] = rowOf(sheet, "bands");
  const curvesAt = ["error", "sigma"].map((name) => rowOf(sheet, /** @type {RowName} */ (name))).filter(([, , tall]) => tall > 0);
  const [first, last] = [curvesAt.at(0), curvesAt.at(-1)];
  for (const span of history.spans((row) => row?.hidden === true)) {
    if (first && last) band(sheet, span, [first[1], last[1] + last[2] - first[1]], ink.hidden, 0.2);
    band(sheet, span, [y, height], ink.hidden, 0.55);
  }
  if (losses.length === 0) for (const span of history.spans(isGone)) band(sheet, span, [y + 2, height - 4], ink.lost, 1);
  const lane = height / losses.length;
  losses.forEach((run, place) => {
    for (const span of run.history.spans(isGone)) band(sheet, span, [y + place * lane, lane - 1], run.colour, 1);
  });
}

/**
 * @param {Sheet} sheet
 * @param {[number, number]} span First and last frame.
 * @param {[number, number]} extent From where along y, and how high.
 * @param {string} colour
 * @param {number} alpha
 */
function band({ context, axis }, [first, last], [from, tall], colour, alpha) {
  const half = axis.width / (axis.frames - 1) / 2;
  const left = Math.max(axis.left, axis.x(first) - half);
  const right = Math.min(axis.left + axis.width, axis.x(last) + half);
  context.globalAlpha = alpha;
  context.fillStyle = colour;
  context.fillRect(left, from, Math.max(1, right - left), tall);
  context.globalAlpha = 1;
}

/**
 * How the weight lies on the particles and where these came from.
 *
 * @param {Sheet} sheet
 * @param {History} history
 * @param {{weight: Curve, mixture: Mixture}} content
 */
function strips(sheet, history, { weight, mixture }) {
  const { context, axis, ink } = sheet;
  const [, essY, essHeight] = rowOf(sheet, "ess");
  const [, y, height] = rowOf(sheet, "proposal");
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
    for (const { colour, share } of mixture.shares(row)) {
      context.fillStyle = ink[colour];
      context.fillRect(left, bottom - share * height, width, share * height);
      bottom -= share * height;
    }
  }
}

/**
 * A tick for all that happened in a frame, each kind in a lane of its own.
 *
 * @param {Sheet} sheet
 * @param {History} history
 * @param {Events} events
 */
function ticks(sheet, history, { lanes, of }) {
  const { context, axis, ink } = sheet;
  const [, y, height] = rowOf(sheet, "events");
  const width = Math.max(2, Math.min(5, axis.width / (axis.frames - 1)));
  for (let frame = 0; frame < history.length; frame += 1) {
    for (const { colour, lane } of of(history.at(frame))) {
      context.fillStyle = ink[colour];
      context.fillRect(axis.x(frame) - width / 2, y + (lane * height) / lanes, width, height / lanes);
    }
  }
}

/**
 * @param {Sheet} sheet
 * @param {Mark[]} changes
 */
function marks(sheet, changes) {
  const { context, axis, ink } = sheet;
  const [, y, height] = rowOf(sheet, "changes");
  context.textAlign = "left";
  context.fillStyle = ink.ink;
  let free = 0;
  changes.forEach(({ frame, lines }, index) => {
    const x = axis.x(frame);
    diamond(context, x, y + height / 2, 5);
    const text = lines.length > 1 ? `${lines[0]}, …` : lines[0];
    const room = (index + 1 < changes.length ? axis.x(changes[index + 1].frame) - 8 : axis.left + axis.width) - x - 9;
    if (x > free && text && context.measureText(text).width <= room) {
      context.fillText(text, x + 9, y + height / 2 + 0.5);
      free = x + 9 + context.measureText(text).width;
    }
  });
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {number} x
 * @param {number} y
 * @param {number} size
 */
function diamond(context, x, y, size) {
  context.beginPath();
  context.moveTo(x, y - size);
  context.lineTo(x + size, y);
  context.lineTo(x, y + size);
  context.lineTo(x - size, y);
  context.fill();
}

/**
 * @param {Sheet} sheet
 * @param {Bookmark[]} bookmarks
 */
function flags({ context, axis, ink }, bookmarks) {
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

/**
 * Paint where the run stands: a line through all rows with a grip on top.
 *
 * @param {Sheet} sheet
 * @param {number} position
 * @param {number} computed
 */
export function playhead(sheet, position, computed) {
  const { context, axis, ink } = sheet;
  const x = Math.round(axis.x(position)) + 0.5;
  const bottom = rowOf(sheet, "changes")[1] - 2;
  context.strokeStyle = ink.ink;
  context.lineWidth = 1.5;
  context.beginPath();
  context.moveTo(x, 6);
  context.lineTo(x, bottom);
  context.stroke();
  context.fillStyle = ink.ink;
  context.strokeStyle = ink.surface;
  context.beginPath();
  context.arc(x, 6, 5, 0, 2 * Math.PI);
  context.fill();
  context.stroke();
  if (computed > position) {
    context.fillStyle = ink.muted;
    context.fillRect(axis.x(computed) - 0.5, 12, 1, bottom - 12);
  }
}
