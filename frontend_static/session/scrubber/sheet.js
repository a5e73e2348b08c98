/** What the scrubber is painted on: rows over one axis of frames. */

/** @typedef {"flags"|"error"|"sigma"|"ess"|"proposal"|"bands"|"changes"} RowName */

/**
 * Where it is painted.
 *
 * @typedef {object} Sheet
 * @property {CanvasRenderingContext2D} context Scaled to CSS px.
 * @property {Axis} axis
 * @property {Record<string, string>} ink Colours by token.
 */

/**
 * Rows from top to bottom; px of the page.
 *
 * @type {Record<RowName, [label: string, top: number, height: number]>}
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
  /**
   * @param {number} width Of the whole scrubber, px.
   * @param {number} frames
   */
  constructor(width, frames) {
    this.left = GUTTER;
    this.width = Math.max(1, width - GUTTER - MARGIN);
    this.frames = Math.max(2, frames);
  }

  /** @param {number} frame */
  x(frame) {
    return this.left + (frame / (this.frames - 1)) * this.width;
  }

  /** @param {number} x */
  frame(x) {
    const frame = Math.round(((x - this.left) / this.width) * (this.frames - 1));
    return Math.min(Math.max(0, frame), this.frames - 1);
  }
}
