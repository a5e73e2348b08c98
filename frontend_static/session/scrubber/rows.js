/** What the scrubber is painted on: rows over one axis of frames. */

import { Scale } from "../../shared/figure/scale.js";

/** @import { Sheet as FigureSheet } from "../../shared/figure/canvas.js" */

/** @typedef {"flags"|"error"|"sigma"|"ess"|"proposal"|"events"|"loss"|"bands"|"changes"} RowName */

/**
 * Where it is painted.
 *
 * @typedef {object} Sheet
 * @property {CanvasRenderingContext2D} pen Scaled to px of the scrubber, which are larger than those of the page where letters are.
 * @property {Axis} axis
 * @property {Rows} rows
 * @property {Record<string, string>} ink Colours by token.
 */

/** @typedef {Partial<Record<RowName, [label: string, top: number, height: number]>>} Rows From top to bottom; px. */

/** What each row is called, how high it is, and how much is free below it, px: from one name to the next is a line of letters. */
const KINDS = /** @type {const} */ ({
  flags: ["", 12, 0],
  error: ["error", 34, 4],
  sigma: ["sigma", 24, 4],
  ess: ["ESS", 6, 5],
  proposal: ["proposal", 8, 5],
  events: ["events", 14, 4],
  loss: ["P(lost)", 8, 5],
  bands: ["hidden, lost", 10, 2],
  changes: ["changes", 16, 2],
});
/** What is left out first where not all of them have room: the plots say it, too. */
const DISPENSABLE = /** @type {const} */ (["proposal", "ess", "sigma", "loss"]);
/** What the first curve gives to the others before, px. */
const GIVEN = 20;

/**
 * Where the rows stand that there is something for. The room of the others is for the first curve, or for the row of marks.
 *
 * @param {readonly RowName[]} missing Rows that nothing is known for.
 * @param {number} height Of all rows.
 * @returns {Rows}
 */
export function rowsWithout(missing, height) {
  const least = (/** @type {RowName[]} */ rows) => rows.reduce((sum, name) => sum + KINDS[name][1] + KINDS[name][2], 0);
  let names = /** @type {RowName[]} */ (Object.keys(KINDS)).filter((name) => !missing.includes(name));
  for (const name of DISPENSABLE) if (least(names) - GIVEN > height) names = names.filter((other) => other !== name);
  const spare = height - least(names);
  const widened = names.find((name) => name === "error" || name === "sigma");
  /** @type {Rows} */
  const rows = {};
  let top = 0;
  for (const name of names) {
    const [label, own, free] = KINDS[name];
    const tall = own + (name === widened ? spare : 0);
    rows[name] = [label, top, tall];
    top += tall + free;
  }
  return rows;
}
/** A row that is not there: what is painted into it is not seen. */
const NOWHERE = /** @type {const} */ (["", 1e4, 0]);

/**
 * Where a row stands.
 *
 * @param {{rows: Rows}} sheet
 * @param {RowName} name
 */
export function rowOf({ rows }, name) {
  return rows[name] ?? NOWHERE;
}

/** Between the values of a row and its edges, px. */
const INSET = 1;
const PLAIN = { title: "", unit: "", low: 0, log: false, names: [], hidden: true };

/**
 * A row as what the kinds of a figure's traces are painted on: frames to the right, values from 0 on upwards.
 *
 * @param {Sheet} sheet
 * @param {RowName} name
 * @param {number} most The value at the top.
 * @param {number} [inset] px
 * @returns {FigureSheet}
 */
export function withinRow({ pen, axis, rows, ink }, name, most, inset = INSET) {
  const [, top, height] = rowOf({ rows }, name);
  const axes = { x: { ...PLAIN, high: axis.frames - 1 }, y: { ...PLAIN, high: most } };
  const box = { left: axis.left, top, width: axis.width, height };
  return { pen, box, x: axis.scale, y: new Scale(axes.y, top + height - inset, top + inset), axes, ink, unit: 1, cased: false };
}

export const GUTTER = 104;
const MARGIN = 10;

/** Where frames lie along x. */
export class Axis {
  /**
   * @param {number} width Of the whole scrubber, px.
   * @param {number} frames
   */
  constructor(width, frames) {
    this.left = GUTTER;
    this.width = Math.max(1, width - GUTTER - MARGIN);
    this.frames = Math.max(2, frames);
    this.scale = new Scale({ low: 0, high: this.frames - 1, log: false }, this.left, this.left + this.width);
  }

  /** @param {number} frame */
  x(frame) {
    return this.scale.at(frame);
  }

  /** @param {number} x */
  frame(x) {
    return Math.min(Math.max(0, Math.round(this.scale.value(x))), this.frames - 1);
  }
}
