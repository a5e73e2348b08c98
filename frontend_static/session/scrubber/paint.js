/**
 * Painting the memory of the run: error, sigma against its thresholds, ESS, proposals, bands and marks, in rows over one
 * axis of frames.
 */

import { within } from "../../shared/figure/canvas.js";
import * as spans from "../../shared/figure/kinds/spans.js";
import { paintCurves, paintThreshold } from "./curves.js";
import { rowOf, withinRow } from "./rows.js";

/** @import { Spans } from "../../shared/figure/traces.js" */
/** @import { Bookmark, ThresholdPublic } from "../../shared/messages.js" */
/** @import { Curve, History, Row } from "../history.js" */
/** @import { Mark } from "../timeline.js" */
/** @import { Curves } from "./curves.js" */
/** @import { RowName, Sheet } from "./rows.js" */

/** @typedef {{colour: string, happened: readonly number[]}} Events Of one kind: above 0 in each frame in which it happened; the colour by its token. */
/** @typedef {{label: string, shares: (row: Row|undefined) => {colour: string, share: number}[]}} Mixture Of samplers; colours by token. */

const LOSS_INSET = 2;
/** Ticks that are nearer to each other than that are one, px. */
const NEAREST_PX = 0.25;

/**
 * What there is to paint.
 *
 * @typedef {object} Content
 * @property {{error: Curves, sigma: Curves}} curves
 * @property {History} history Of the active branch, which alone has strips and bands.
 * @property {ThresholdPublic[]} thresholds
 * @property {Bookmark[]} bookmarks
 * @property {Mark[]} marks
 * @property {number} smallest The least that an axis spans.
 * @property {Curve} weight The share of the particles that carries the weight.
 * @property {Mixture} mixture
 * @property {Curve} loss The probability that the target is lost.
 * @property {readonly Events[]} events A lane each.
 * @property {Spans} hidden
 * @property {readonly Spans[]} losses Of the active branch, or of several runs, in whose colours they are shown, a lane each.
 * @property {string} gone What the row of bands is called, by what is known: "hidden", "lost" or both.
 */

/**
 * Paint all but the playhead.
 *
 * @param {Sheet} sheet
 * @param {Content} content
 */
export function paint(sheet, content) {
  const { pen } = sheet;
  const { curves, smallest, thresholds, history } = content;
  pen.clearRect(0, 0, pen.canvas.width, pen.canvas.height);
  wells(sheet);
  bands(sheet, content);
  paintCurves(sheet, "error", curves.error, { most: curves.error.top(smallest), width: 1.6, hasArea: true });
  const limits = thresholds.flatMap(({ steps }) => steps.map(({ value }) => 1.25 * (value ?? 0)));
  const most = Math.max(curves.sigma.top(smallest), ...limits);
  paintCurves(sheet, "sigma", curves.sigma, { most, width: 1.4 });
  for (const { steps } of thresholds) paintThreshold(sheet, steps, most);
  strips(sheet, history, content);
  ticks(sheet, content.events);
  marks(sheet, content.marks);
  flags(sheet, content.bookmarks);
}

/**
 * What each row is called.
 *
 * @param {import("./rows.js").Rows} rows
 * @param {Content} content
 * @returns {{label: string, middle: number}[]} From top to bottom; px from the top.
 */
export function labels(rows, { thresholds, mixture, gone }) {
  /** @type {Partial<Record<RowName, string>>} */
  const own = { sigma: thresholds.length > 0 ? "sigma | limit" : "sigma", proposal: mixture.label, bands: gone };
  const listed = /** @type {[RowName, [string, number, number]][]} */ (Object.entries(rows));
  return listed.map(([name, [label, top, height]]) => ({ label: own[name] ?? label, middle: top + height / 2 })).filter(({ label }) => label !== "");
}

/** @param {Sheet} sheet */
function wells({ pen, axis, ink, rows }) {
  pen.fillStyle = ink.well;
  for (const [name, [, top, height]] of /** @type {[RowName, [string, number, number]][]} */ (Object.entries(rows))) {
    if (name !== "flags" && name !== "changes") pen.fillRect(axis.left, top, axis.width, height);
  }
}

/**
 * Where the target is hidden, behind the curves as well, and where it is lost.
 *
 * @param {Sheet} sheet
 * @param {Pick<Content, "hidden"|"losses">} content
 */
function bands(sheet, { hidden, losses }) {
  const row = withinRow(sheet, "bands", losses.length, 0);
  const curvesAt = ["error", "sigma"].map((name) => rowOf(sheet, /** @type {RowName} */ (name))).filter(([, , tall]) => tall > 0);
  const [first, last] = [curvesAt.at(0), curvesAt.at(-1)];
  if (first && last) {
    const behind = { ...row, box: { ...row.box, top: first[1], height: last[1] + last[2] - first[1] } };
    within(behind, 0, () => spans.paint(behind, { ...hidden, opacity: 0.2 }));
  }
  within(row, 0, () => spans.paint(row, { ...hidden, opacity: 0.55 }));
  // A loss leaves something to be seen of what is behind it, and of the lane beside.
  const [apart, beside] = losses.length === 1 ? [LOSS_INSET, LOSS_INSET] : [0, 1];
  const lane = row.box.height / losses.length;
  losses.forEach((trace, place) => {
    const box = { ...row.box, top: row.box.top + place * lane + apart, height: lane - apart - beside };
    within({ ...row, box }, 0, () => spans.paint({ ...row, box }, trace));
  });
}

/**
 * How the weight lies on the particles, where these came from, and how probable it is that the target is lost: by height
 * and by how opaque it is, so that it is not told by colour alone.
 *
 * @param {Sheet} sheet
 * @param {History} history
 * @param {{weight: Curve, mixture: Mixture, loss: Curve}} content
 */
function strips(sheet, history, { weight, mixture, loss }) {
  const { pen, axis, ink } = sheet;
  const [, essY, essHeight] = rowOf(sheet, "ess");
  const [, y, height] = rowOf(sheet, "proposal");
  const [, lossY, lossHeight] = rowOf(sheet, "loss");
  const bucket = Math.max(1, Math.floor(history.length / axis.width));
  const step = (axis.width / (axis.frames - 1)) * bucket;
  for (let frame = 0; frame < history.length; frame += bucket) {
    const row = history.at(frame);
    const left = Math.max(axis.left, axis.x(frame) - step / 2);
    const width = Math.min(axis.x(frame) + step / 2, axis.left + axis.width) - left + 0.3;
    const carrying = weight(row);
    if (carrying !== null) {
      pen.fillStyle = ink.ramp;
      pen.globalAlpha = Math.min(1, 0.08 + 0.92 * carrying);
      pen.fillRect(left, essY, width, essHeight);
      pen.globalAlpha = 1;
    }
    const probability = history.most(loss, frame, Math.min(frame + bucket, history.length) - 1);
    if (probability !== null) {
      pen.fillStyle = ink.lost;
      pen.globalAlpha = 0.4 + 0.6 * probability;
      pen.fillRect(left, lossY + (1 - probability) * lossHeight, width, probability * lossHeight);
      pen.globalAlpha = 1;
    }
    let bottom = y + height;
    for (const { colour, share } of mixture.shares(row)) {
      pen.fillStyle = ink[colour];
      pen.fillRect(left, bottom - share * height, width, share * height);
      bottom -= share * height;
    }
  }
}

/**
 * A tick for all that happened in a frame, each kind in a lane of its own.
 *
 * @param {Sheet} sheet
 * @param {readonly Events[]} events
 */
function ticks(sheet, events) {
  const { pen, axis, ink } = sheet;
  const [, y, height] = rowOf(sheet, "events");
  const width = Math.max(2, Math.min(5, axis.width / (axis.frames - 1)));
  events.forEach(({ colour, happened }, lane) => {
    const [top, tall] = [y + (lane * height) / events.length, height / events.length];
    pen.fillStyle = ink[colour];
    let last = -Infinity;
    happened.forEach((value, frame) => {
      if (!(value > 0)) return;
      const x = axis.x(frame);
      if (x - last < NEAREST_PX) return;
      pen.fillRect(x - width / 2, top, width, tall);
      last = x;
    });
  });
}

/**
 * @param {Sheet} sheet
 * @param {Mark[]} changes
 */
function marks(sheet, changes) {
  const { pen, axis, ink } = sheet;
  const [, y, height] = rowOf(sheet, "changes");
  pen.textAlign = "left";
  pen.fillStyle = ink.ink;
  let free = 0;
  changes.forEach(({ frame, lines }, index) => {
    const x = axis.x(frame);
    diamond(pen, x, y + height / 2, 5);
    const text = lines.length > 1 ? `${lines[0]}, …` : lines[0];
    const room = (index + 1 < changes.length ? axis.x(changes[index + 1].frame) - 8 : axis.left + axis.width) - x - 9;
    if (x > free && text && pen.measureText(text).width <= room) {
      pen.fillText(text, x + 9, y + height / 2 + 0.5);
      free = x + 9 + pen.measureText(text).width;
    }
  });
}

/**
 * @param {CanvasRenderingContext2D} pen
 * @param {number} x
 * @param {number} y
 * @param {number} size
 */
function diamond(pen, x, y, size) {
  pen.beginPath();
  pen.moveTo(x, y - size);
  pen.lineTo(x + size, y);
  pen.lineTo(x, y + size);
  pen.lineTo(x - size, y);
  pen.fill();
}

/**
 * @param {Sheet} sheet
 * @param {Bookmark[]} bookmarks
 */
function flags({ pen, axis, ink }, bookmarks) {
  for (const { frame } of bookmarks) {
    const x = Math.round(axis.x(frame)) + 0.5;
    pen.fillStyle = ink.accent;
    pen.beginPath();
    pen.moveTo(x - 4, 0);
    pen.lineTo(x + 4, 0);
    pen.lineTo(x + 4, 11);
    pen.lineTo(x, 7.5);
    pen.lineTo(x - 4, 11);
    pen.fill();
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
  const { pen, axis, ink } = sheet;
  const x = Math.round(axis.x(position)) + 0.5;
  const bottom = rowOf(sheet, "changes")[1] - 2;
  pen.strokeStyle = ink.ink;
  pen.lineWidth = 1.5;
  pen.beginPath();
  pen.moveTo(x, 6);
  pen.lineTo(x, bottom);
  pen.stroke();
  pen.fillStyle = ink.ink;
  pen.strokeStyle = ink.surface;
  pen.beginPath();
  pen.arc(x, 6, 5, 0, 2 * Math.PI);
  pen.fill();
  pen.stroke();
  if (computed > position) {
    pen.fillStyle = ink.muted;
    pen.fillRect(axis.x(computed) - 0.5, 12, 1, bottom - 12);
  }
}
