/** Painting a heat map: its cells, its scales, and the rings around cells. */

import { css, inkOn } from "../shared/colours.js";
import { LEFT, TOP } from "./grid.js";
import { hatch, short, sparse, titled } from "./strokes.js";

/** @import { AxisPublic } from "../shared/messages.js" */
/** @import { Axes, Cell, Grid } from "./grid.js" */
/** @import { Box } from "./strokes.js" */

const SMALLEST_TEXT_PX = 30;
const FONT = '12px system-ui, -apple-system, "Segoe UI", Roboto, "Liberation Sans", sans-serif';

/**
 * What a cell looks like.
 *
 * @typedef {object} Look
 * @property {Readonly<import("../shared/palette.js").Colour>|null} colour Null where there is no value yet.
 * @property {string} [text] Written into the cell if there is room.
 * @property {number} filled Share of the cell that is coloured, 0..1.
 * @property {boolean} [outlined] With a line around it, for colours near that of the page.
 * @property {boolean} hatched Not tested, and not going to be.
 */

/**
 * Where it is painted.
 *
 * @typedef {object} Sheet
 * @property {CanvasRenderingContext2D} pen Scaled to px of the page.
 * @property {Grid} grid
 * @property {Record<string, string>} ink Colours by token.
 */

/**
 * @param {Sheet} sheet
 * @param {Axes} axes
 * @param {(index: number) => Look} look By the number of the cell.
 */
export function paintMap(sheet, axes, look) {
  const { pen, grid } = sheet;
  pen.clearRect(0, 0, grid.width, grid.height);
  for (let j = 0; j < grid.up; j += 1) {
    for (let i = 0; i < grid.across; i += 1) paintCell(sheet, grid.box({ i, j }), look(grid.index({ i, j })));
  }
  paintAcross(sheet, axes.x);
  if (axes.y !== null) paintUp(sheet, axes.y);
}

/**
 * Put a ring around a cell.
 *
 * @param {Sheet} sheet
 * @param {Cell} cell
 * @param {string} colour
 * @param {number} width
 */
export function paintRing({ pen, grid, ink }, cell, colour, width) {
  const [x, y, wide, high] = grid.box(cell);
  for (const [line, stroke] of /** @type {[number, string][]} */ ([[width + 2, ink.surface], [width, colour]])) {
    pen.lineWidth = line;
    pen.strokeStyle = stroke;
    pen.strokeRect(x - 1, y - 1, wide + 1, high + 1);
  }
}

/**
 * @param {Sheet} sheet
 * @param {Box} box
 * @param {Look} look
 */
function paintCell(sheet, [x, y, wide, high], look) {
  const { pen, ink } = sheet;
  const gap = Math.min(wide, high) > 8 ? 1 : 0;
  /** @type {Box} */
  const box = [x, y, wide - gap, high - gap];
  const isWhole = look.filled === 1;
  if (look.hatched) {
    hatch(pen, box, ink.line);
    return;
  }
  if (!isWhole || look.colour === null) outline(sheet, box);
  if (look.filled === 0) return;
  if (look.colour === null) {
    // Computed, but without a value: no run succeeded, say.
    if (isWhole) write(pen, "–", ink.muted, box);
    return;
  }
  fillCell(sheet, box, look.colour, look.filled);
  if (look.outlined) outline(sheet, box);
  if (look.text && isWhole) write(pen, look.text, inkOn(look.colour), box);
}

/**
 * An area that grows with the runs that are done; from the first on it can be seen.
 *
 * @param {Sheet} sheet
 * @param {Box} box
 * @param {Readonly<import("../shared/palette.js").Colour>} colour
 * @param {number} share
 */
function fillCell({ pen }, [x, y, wide, high], colour, share) {
  const side = Math.max(Math.sqrt(share), 0.25);
  const [inner, tall] = [wide * side, high * side];
  pen.fillStyle = css(colour);
  pen.fillRect(x + (wide - inner) / 2, y + (high - tall) / 2, inner, tall);
}

/**
 * @param {Sheet} sheet
 * @param {Box} box
 */
function outline({ pen, ink }, [x, y, wide, high]) {
  pen.strokeStyle = ink.line;
  pen.lineWidth = 1;
  pen.strokeRect(x + 0.5, y + 0.5, wide - 1, high - 1);
}

/**
 * Write into a cell, if there is room.
 *
 * @param {CanvasRenderingContext2D} pen
 * @param {string} text
 * @param {string} colour
 * @param {Box} box
 */
function write(pen, text, colour, [x, y, wide, high]) {
  if (wide < SMALLEST_TEXT_PX || high < SMALLEST_TEXT_PX / 2) return;
  pen.fillStyle = colour;
  pen.font = FONT.replace("12px", `${Math.round(Math.min(17, Math.max(11, 0.3 * Math.min(wide, high))))}px`);
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.fillText(text, x + wide / 2, y + high / 2 + 0.5);
}

/**
 * @param {Sheet} sheet
 * @param {AxisPublic} axis
 */
function paintAcross({ pen, grid, ink }, axis) {
  const { across, wide } = grid;
  const below = TOP + grid.up * grid.high;
  pen.font = FONT;
  pen.fillStyle = ink.muted;
  pen.textBaseline = "top";
  pen.textAlign = "center";
  const widest = Math.max(...axis.values.map((value) => pen.measureText(short(value)).width)) + 6;
  for (const i of sparse(across, Math.max(1, Math.ceil(widest / wide)))) {
    pen.fillText(short(axis.values[i]), LEFT + (i + 0.5) * wide, below + 5);
  }
  pen.fillStyle = ink.ink;
  pen.fillText(titled(axis), LEFT + (across * wide) / 2, below + 23, Math.max(across * wide, grid.width - LEFT));
}

/**
 * @param {Sheet} sheet
 * @param {AxisPublic} axis
 */
function paintUp({ pen, grid, ink }, axis) {
  const { up, high } = grid;
  pen.font = FONT;
  pen.fillStyle = ink.muted;
  pen.textAlign = "right";
  pen.textBaseline = "middle";
  for (const j of sparse(up, Math.max(1, Math.ceil(14 / high)))) {
    pen.fillText(short(axis.values[j]), LEFT - 6, TOP + (up - j - 0.5) * high, LEFT - 22);
  }
  pen.save();
  pen.translate(8, TOP + (up * high) / 2);
  pen.rotate(-Math.PI / 2);
  pen.textAlign = "center";
  pen.fillStyle = ink.ink;
  pen.fillText(titled(axis), 0, 0, Math.max(up * high + TOP + 20, 90));
  pen.restore();
}
