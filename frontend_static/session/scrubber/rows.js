/** What the scrubber is painted on: rows over one axis of frames. */

/** @typedef {"flags"|"error"|"sigma"|"ess"|"proposal"|"events"|"bands"|"changes"} RowName */

/**
 * Where it is painted.
 *
 * @typedef {object} Sheet
 * @property {CanvasRenderingContext2D} context Scaled to CSS px.
 * @property {Axis} axis
 * @property {Rows} rows
 * @property {Record<string, string>} ink Colours by token.
 */

/** @typedef {Partial<Record<RowName, [label: string, top: number, height: number]>>} Rows From top to bottom; px of the page. */

/** What each row is called, how high it is, and how much is free below it, px of the page. */
const KINDS = /** @type {const} */ ({
  flags: ["", 12, 0],
  error: ["error", 34, 4],
  sigma: ["sigma", 24, 4],
  ess: ["ESS", 6, 4],
  proposal: ["proposal", 8, 4],
  events: ["events", 14, 4],
  bands: ["hidden, lost", 10, 2],
  changes: ["changes", 16, 2],
});
export const HEIGHT = 130;

/**
 * Where the rows stand that there is something for. The room of the others is for the first curve, or for the row of marks.
 *
 * @param {readonly RowName[]} missing Rows that nothing is known for.
 * @returns {Rows}
 */
export function rowsWithout(missing) {
  const names = /** @type {RowName[]} */ (Object.keys(KINDS)).filter((name) => !missing.includes(name));
  const spare = HEIGHT - names.reduce((sum, name) => sum + KINDS[name][1] + KINDS[name][2], 0);
  const widened = names.find((name) => name === "error" || name === "sigma");
  /** @type {Rows} */
  const rows = {};
  let top = 0;
  for (const name of names) {
    const [label, least, free] = KINDS[name];
    const height = least + (name === widened ? spare : 0);
    rows[name] = [label, top, height];
    top += height + free;
  }
  return rows;
}
/** A row that is not there: what is painted into it is not seen. */
const NOWHERE = /** @type {const} */ (["", HEIGHT, 0]);

/**
 * Where a row stands.
 *
 * @param {{rows: Rows}} sheet
 * @param {RowName} name
 */
export function rowOf({ rows }, name) {
  return rows[name] ?? NOWHERE;
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
