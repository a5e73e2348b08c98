/** Where the cells of a map are. */

/** @import { AxisPublic } from "../shared/messages.js" */
/** @import { Box } from "./strokes.js" */

/** @typedef {{i: number, j: number}} Cell By its places on the axes. */
/** @typedef {{x: AxisPublic, y: AxisPublic|null}} Axes */

export const LEFT = 46;
export const TOP = 8;
const RIGHT = 10;
const BOTTOM = 44;
const LARGEST_CELL_PX = 72;
const LONGEST_HEIGHT_PX = 400;
const LOWEST_CELL_PX = 3;

export class Grid {
  /**
   * @param {Axes} axes
   * @param {number} width Of the map, px.
   */
  constructor({ x, y }, width) {
    this.width = width;
    this.across = x.values.length;
    this.up = y?.values.length ?? 1;
    /** Extent of a cell, px. */
    this.wide = Math.min((width - LEFT - RIGHT) / this.across, LARGEST_CELL_PX);
    this.high = Math.max(Math.min(this.wide, (LONGEST_HEIGHT_PX - TOP - BOTTOM) / this.up), LOWEST_CELL_PX);
    this.height = Math.round(this.high * this.up + TOP + BOTTOM);
  }

  /**
   * Corner and extent of a cell; the values of the y axis grow upwards.
   *
   * @param {Cell} cell
   * @returns {Box}
   */
  box({ i, j }) {
    const [x0, x1] = [Math.round(LEFT + i * this.wide), Math.round(LEFT + (i + 1) * this.wide)];
    const [y0, y1] = [Math.round(TOP + (this.up - 1 - j) * this.high), Math.round(TOP + (this.up - j) * this.high)];
    return [x0, y0, x1 - x0, y1 - y0];
  }

  /**
   * The cell at a place, if there is one.
   *
   * @param {number} x
   * @param {number} y
   * @returns {Cell|null}
   */
  at(x, y) {
    const i = Math.floor((x - LEFT) / this.wide);
    const j = this.up - 1 - Math.floor((y - TOP) / this.high);
    return i >= 0 && i < this.across && j >= 0 && j < this.up ? { i, j } : null;
  }

  /**
   * The number of a cell, row after row.
   *
   * @param {Cell} cell
   */
  index({ i, j }) {
    return j * this.across + i;
  }
}
