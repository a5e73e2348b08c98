/** A map whose cells are told one by one how they look: filled as far as they are there, hatched where there is nothing. */

import { css, inkOn } from "../colours.js";

/** @import { Box } from "./box.js" */
/** @import { Sheet } from "./canvas.js" */
/** @import { Cell, CellLook, CellMap, Trace } from "./traces.js" */

/** Cells of at least that extent stand apart. */
const APART_FROM_PX = 8;
const SMALLEST_TEXT_PX = 30;
/** Of the letters in a cell, px, and in that of the cell. */
const [SMALLEST_LETTERS, LARGEST_LETTERS, LETTERS] = [11, 17, 0.3];
const HATCH_EVERY_PX = 5;
/** From the first run on a cell can be seen. */
const LEAST_SIDE = 0.25;

/**
 * @param {Trace} trace
 * @returns {trace is CellMap}
 */
export function isCellMap(trace) {
  return trace.kind === "heat map" && "look" in trace;
}

/**
 * The cells of a map on its sheet.
 *
 * @param {Sheet} sheet
 * @param {CellMap} map
 */
export function cellsOf({ x, y }, { across, up }) {
  const edges = (/** @type {import("./scale.js").Scale} */ scale, /** @type {number} */ count) =>
    Array.from({ length: count + 1 }, (_, place) => Math.round(scale.at(place - 0.5)));
  const [columns, rows] = [edges(x, across), edges(y, up)];
  return {
    /**
     * Corner and extent of a cell; the rows are counted upwards.
     *
     * @param {Cell} cell
     * @returns {Box}
     */
    box: ({ i, j }) => ({ left: columns[i], top: rows[j + 1], width: columns[i + 1] - columns[i], height: rows[j] - rows[j + 1] }),
    /**
     * The cell at a place, if there is one.
     *
     * @param {number} px
     * @param {number} py
     * @returns {Cell|null}
     */
    at: (px, py) => {
      const [i, j] = [Math.round(x.value(px)), Math.round(y.value(py))];
      return i >= 0 && i < across && j >= 0 && j < up ? { i, j } : null;
    },
  };
}

/**
 * @param {Sheet} sheet
 * @param {CellMap} map
 */
export function paintCells(sheet, map) {
  const { box } = cellsOf(sheet, map);
  const family = getComputedStyle(sheet.pen.canvas).fontFamily;
  for (let j = 0; j < map.up; j += 1) {
    for (let i = 0; i < map.across; i += 1) paintCell(sheet, box({ i, j }), map.look(j * map.across + i), family);
  }
}

/**
 * @param {Sheet} sheet
 * @param {Box} whole
 * @param {CellLook} look
 * @param {string} family Of the letters.
 */
function paintCell(sheet, { left, top, width, height }, { colour, text, filled, isOutlined, isHatched }, family) {
  const { pen, ink } = sheet;
  const gap = Math.min(width, height) > APART_FROM_PX ? 1 : 0;
  const box = { left, top, width: width - gap, height: height - gap };
  if (isHatched) {
    hatch(pen, box, ink.line);
    return;
  }
  const isWhole = filled === 1;
  if (!isWhole || colour === null) outline(pen, box, ink.line);
  if (filled === 0) return;
  if (colour === null) {
    // Computed, but without a value: no run succeeded, say.
    if (isWhole) write(sheet, "–", ink.muted, box, family);
    return;
  }
  fill(pen, box, css(colour), filled);
  if (isOutlined) outline(pen, box, ink.line);
  if (text && isWhole) write(sheet, text, inkOn(colour), box, family);
}

/**
 * An area that grows with what is there.
 *
 * @param {CanvasRenderingContext2D} pen
 * @param {Box} box
 * @param {string} colour
 * @param {number} share
 */
function fill(pen, { left, top, width, height }, colour, share) {
  const side = Math.max(Math.sqrt(share), LEAST_SIDE);
  const [wide, high] = [width * side, height * side];
  pen.fillStyle = colour;
  pen.fillRect(left + (width - wide) / 2, top + (height - high) / 2, wide, high);
}

/**
 * @param {CanvasRenderingContext2D} pen
 * @param {Box} box
 * @param {string} colour
 */
function outline(pen, { left, top, width, height }, colour) {
  pen.strokeStyle = colour;
  pen.lineWidth = 1;
  pen.strokeRect(left + 0.5, top + 0.5, width - 1, height - 1);
}

/**
 * Write into a cell, if there is room.
 *
 * @param {Sheet} sheet
 * @param {string} text
 * @param {string} colour
 * @param {Box} box
 * @param {string} family
 */
function write({ pen, unit }, text, colour, { left, top, width, height }, family) {
  if (width < SMALLEST_TEXT_PX || height < SMALLEST_TEXT_PX / 2) return;
  const size = Math.min(LARGEST_LETTERS * Math.max(1, unit), Math.max(SMALLEST_LETTERS, LETTERS * Math.min(width, height)));
  pen.fillStyle = colour;
  pen.font = `${Math.round(size)}px ${family}`;
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  pen.fillText(text, left + width / 2, top + height / 2 + 0.5);
}

/**
 * Lines across a cell in which there is nothing, and will be nothing.
 *
 * @param {CanvasRenderingContext2D} pen
 * @param {Box} box
 * @param {string} colour
 */
function hatch(pen, box, colour) {
  const { left, top, width, height } = box;
  pen.save();
  pen.beginPath();
  pen.rect(left, top, width, height);
  pen.clip();
  pen.strokeStyle = colour;
  pen.lineWidth = 1;
  pen.beginPath();
  for (let along = -height; along < width; along += HATCH_EVERY_PX) {
    pen.moveTo(left + along, top + height);
    pen.lineTo(left + along + height, top);
  }
  pen.stroke();
  pen.restore();
  outline(pen, box, colour);
}
