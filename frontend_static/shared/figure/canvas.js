/** What traces are painted on, and the strokes that they share. */

import { DASHED, LOOKS } from "./line_styles.js";

/** @import { Box } from "./box.js" */
/** @import { Ink } from "./line_styles.js" */
/** @import { Scale } from "./scale.js" */
/** @import { Axis, Cell } from "./traces.js" */

/**
 * Where a panel's traces are painted.
 *
 * @typedef {object} Sheet
 * @property {CanvasRenderingContext2D} pen Scaled to px of the page.
 * @property {Box} box
 * @property {Scale} x
 * @property {Scale} y
 * @property {{x: Axis, y: Axis}} axes
 * @property {Record<string, string>} ink Colours by token.
 * @property {number} unit px of the page for what is 1 px at letters of 16 px.
 * @property {boolean} cased Whether lines need a rim to be seen on what lies behind them.
 */

/**
 * What is pointed at.
 *
 * @typedef {object} Hit
 * @property {number} distance px from the pointer.
 * @property {number} x px
 * @property {number} y px
 * @property {string} words
 * @property {Cell} [cell] Of a map whose cells are chosen.
 * @property {Box} [box] Where that is.
 */

/** So near a pointer has to be, px at letters of 16 px. What has an area is as near as that, so that lines on it win. */
export const REACH = 14;

/** How far the rim of what is cased stands out, in all, px at letters of 16 px. */
export const RIM = 2.5;

/**
 * Draw a line in the way of its ink.
 *
 * @param {Sheet} sheet
 * @param {Path2D} path
 * @param {Ink} ink
 * @param {{dashed?: boolean, solid?: number}} [options] `solid` is the width of a plain line, whatever the ink.
 */
export function stroke(sheet, path, ink, { dashed = false, solid } = {}) {
  const { pen, unit } = sheet;
  const look = LOOKS[ink];
  const width = (solid ?? look.width) * unit;
  pen.save();
  pen.lineJoin = "round";
  pen.lineCap = "butt";
  const plain = solid === undefined ? look.dash : [];
  pen.setLineDash((dashed ? DASHED : plain).map((length) => length * unit));
  if (sheet.cased) {
    pen.strokeStyle = sheet.ink.surface;
    pen.lineWidth = width + RIM * unit;
    pen.stroke(path);
  }
  pen.strokeStyle = sheet.ink[ink];
  pen.lineWidth = width;
  pen.stroke(path);
  pen.restore();
}

/**
 * Fill an area in a light shade of its ink, so that a grid and what lies behind shine through.
 *
 * @param {Sheet} sheet
 * @param {Path2D} path
 * @param {Ink} ink
 * @param {number} [opacity]
 */
export function shade(sheet, path, ink, opacity = 0.3) {
  const { pen } = sheet;
  pen.save();
  pen.globalAlpha = opacity;
  pen.fillStyle = sheet.ink[ink];
  pen.fill(path);
  pen.restore();
}

/**
 * Run `paint` with nothing painted outside of the box but marks that stand at its edge.
 *
 * @param {Sheet} sheet
 * @param {number} over How far these reach beyond it, px.
 * @param {() => void} paint
 */
export function within({ pen, box }, over, paint) {
  pen.save();
  pen.beginPath();
  pen.rect(box.left - over, box.top - over, box.width + 2 * over, box.height + 2 * over);
  pen.clip();
  paint();
  pen.restore();
}

/**
 * The colour of an ink: what it is called in the theme, or itself.
 *
 * @param {Sheet} sheet
 * @param {string} ink
 */
export function colourOf(sheet, ink) {
  return sheet.ink[ink] ?? ink;
}

/**
 * Draw a line of any colour and width.
 *
 * @param {Sheet} sheet
 * @param {Path2D} path
 * @param {{ink: string, width: number, dashed?: boolean, opacity?: number}} look
 */
export function line(sheet, path, { ink, width, dashed = false, opacity = 1 }) {
  const { pen, unit } = sheet;
  pen.save();
  pen.globalAlpha = opacity;
  pen.lineJoin = "round";
  pen.strokeStyle = colourOf(sheet, ink);
  pen.lineWidth = width * unit;
  if (dashed) pen.setLineDash(DASHED.map((length) => length * unit));
  pen.stroke(path);
  pen.restore();
}

/**
 * Fill an area with a shade of any colour.
 *
 * @param {Sheet} sheet
 * @param {Path2D} path
 * @param {{ink: string, opacity: number}} look
 */
export function tint(sheet, path, { ink, opacity }) {
  const { pen } = sheet;
  pen.save();
  pen.globalAlpha = opacity;
  pen.fillStyle = colourOf(sheet, ink);
  pen.fill(path);
  pen.restore();
}

/** Opacities of single things are shown in so many steps, each of which is one path. */
const LEVELS = 12;

/**
 * One path for all things that are about equally opaque, the faintest first.
 *
 * @param {readonly number[]} opacity
 * @param {(index: number, path: Path2D) => void} add
 * @returns {[opacity: number, path: Path2D][]}
 */
export function byOpacity(opacity, add) {
  /** @type {Map<number, Path2D>} */
  const paths = new Map();
  opacity.forEach((share, index) => {
    const level = Math.ceil(share * LEVELS);
    const path = paths.get(level) ?? new Path2D();
    paths.set(level, path);
    add(index, path);
  });
  return [...paths].sort(([one], [other]) => one - other).map(([level, path]) => [level / LEVELS, path]);
}
