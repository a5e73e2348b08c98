/**
 * Heat maps: amounts over a plane in viridis, or cells that are told one by one how they look, filled as far as they are
 * there and hatched where there is nothing.
 */

import { css, inkOn, viridis } from "../colours.js";
import { REACH, within } from "./paint.js";
import { named, saying, written } from "./scale.js";

/** @import { Box } from "./axes.js" */
/** @import { Kind } from "./kinds.js" */
/** @import { Sheet } from "./paint.js" */
/** @import { Scale } from "./scale.js" */
/** @import { Cell, CellLook, CellMap, HeatMap, Trace } from "./traces.js" */
/** @import { HeatMap as Amounts } from "./types.js" */

/** Cells of at least that extent stand apart. */
const APART_FROM_PX = 8;
const SMALLEST_TEXT_PX = 30;
/** Of the letters in a cell, px, and in that of the cell. */
const [SMALLEST_LETTERS, LARGEST_LETTERS, LETTERS] = [11, 17, 0.3];
const HATCH_EVERY_PX = 5;
/** From the first run on a cell can be seen. */
const LEAST_SIDE = 0.25;
const LEVELS = 256;
/** Colours as a canvas keeps them: bytes of red, green, blue and opacity, as one number. */
const COLOURS = new Uint32Array(Uint8Array.from(Array.from({ length: LEVELS }, (_, level) => [...viridis(level / (LEVELS - 1)), 255]).flat()).buffer);

/** @type {Kind<HeatMap>} */
export const heatMap = {
  over: 0,
  paint: (sheet, map) => ("look" in map ? paintCells(sheet, map) : paintAmounts(sheet, map)),
  near(sheet, map, px, py) {
    const { x, y, axes, unit } = sheet;
    const hit = { distance: REACH * unit, x: px, y: py };
    if ("look" in map) {
      const cell = cellsOf(sheet, map).at(px, py);
      return cell && { ...hit, words: "", cell };
    }
    const [column, row] = [cellAt(map.x, x.value(px)), cellAt(map.y, y.value(py))];
    const value = map.values[row]?.[column] ?? null;
    if (value === null) return null;
    const [atX, atY] = [Number(map.x[column]), Number(map.y[row])];
    return { ...hit, words: saying(map, named(axes.x, atX), named(axes.y, atY), written(Number(value.toPrecision(3)))) };
  },
};

/** @param {Amounts} map */
export function most({ values }) {
  return values.flat().reduce((/** @type {number} */ largest, value) => Math.max(largest, value ?? 0), 0);
}

/**
 * One pixel a cell, drawn as large as the cells are.
 *
 * @param {Sheet} sheet
 * @param {Amounts} map
 */
function paintAmounts({ pen, x, y }, map) {
  const { values } = map;
  const image = new ImageData(Math.max(1, values[0]?.length ?? 0), Math.max(1, values.length));
  const cells = new Uint32Array(image.data.buffer);
  const scale = (LEVELS - 1) / (most(map) || 1);
  values.flat().forEach((value, index) => {
    if (value !== null) cells[index] = COLOURS[Math.min(Math.max(Math.round(value * scale), 0), LEVELS - 1)];
  });
  const picture = new OffscreenCanvas(image.width, image.height);
  picture.getContext("2d")?.putImageData(image, 0, 0);
  const [left, right] = edges(map.x).map((value) => x.at(value));
  const [bottom, top] = edges(map.y).map((value) => y.at(value));
  pen.save();
  pen.imageSmoothingEnabled = false;
  // Row 0 of the picture lies at the first y, wherever that is.
  pen.transform(Math.sign(right - left), 0, 0, Math.sign(top - bottom), left, bottom);
  pen.drawImage(picture, 0, 0, Math.abs(right - left), Math.abs(top - bottom));
  pen.restore();
}

/**
 * From the edge of the first cell to that of the last.
 *
 * @param {readonly (number|null)[]} middles
 */
function edges(middles) {
  const [first, last] = [Number(middles[0]), Number(middles[middles.length - 1])];
  const half = middles.length > 1 ? (last - first) / (middles.length - 1) / 2 : 0.5;
  return [first - half, last + half];
}

/**
 * @param {readonly (number|null)[]} middles
 * @param {number} value
 */
function cellAt(middles, value) {
  const [first, last] = edges(middles);
  return Math.floor(((value - first) / (last - first)) * middles.length);
}

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
 * @param {Pick<Sheet, "x"|"y">} sheet
 * @param {Pick<CellMap, "across"|"up">} map
 */
export function cellsOf({ x, y }, { across, up }) {
  const edgesOf = (/** @type {Scale} */ scale, /** @type {number} */ count) =>
    Array.from({ length: count + 1 }, (_, place) => Math.round(scale.at(place - 0.5)));
  const [columns, rows] = [edgesOf(x, across), edgesOf(y, up)];
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
function paintCells(sheet, map) {
  const { box } = cellsOf(sheet, map);
  const { fontFamily } = getComputedStyle(sheet.pen.canvas);
  for (let index = 0; index < map.across * map.up; index += 1) {
    paintCell(sheet, box({ i: index % map.across, j: Math.floor(index / map.across) }), map.look(index), fontFamily);
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
  const isWhole = filled === 1 && !isHatched;
  if (isHatched) within({ pen, box }, 0, () => hatch(pen, box, ink.line));
  else if (colour !== null && filled > 0) {
    // An area that grows with what is there.
    const side = Math.max(Math.sqrt(filled), LEAST_SIDE);
    pen.fillStyle = css(colour);
    pen.fillRect(left + (box.width * (1 - side)) / 2, top + (box.height * (1 - side)) / 2, box.width * side, box.height * side);
  }
  if (!isWhole || colour === null || isOutlined) {
    pen.strokeStyle = ink.line;
    pen.lineWidth = 1;
    pen.strokeRect(left + 0.5, top + 0.5, box.width - 1, box.height - 1);
  }
  // Computed, but without a value: no run succeeded, say.
  if (isWhole && colour === null) write(sheet, "–", ink.muted, box, family);
  else if (isWhole && colour !== null && text) write(sheet, text, inkOn(colour), box, family);
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
function hatch(pen, { left, top, width, height }, colour) {
  pen.strokeStyle = colour;
  pen.lineWidth = 1;
  pen.beginPath();
  for (let along = -height; along < width; along += HATCH_EVERY_PX) {
    pen.moveTo(left + along, top + height);
    pen.lineTo(left + along + height, top);
  }
  pen.stroke();
}
