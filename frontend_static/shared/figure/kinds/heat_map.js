/** Amounts over a plane, each cell in its colour of viridis or as it is told to look. */

import { viridis } from "../../colours.js";
import { cellsOf, paintCells } from "../cells.js";
import { REACH } from "../canvas.js";
import { named, saying } from "../description.js";
import { written } from "../ticks.js";

/** @import { HeatMap as Amounts } from "../types.js" */
/** @import { HeatMap } from "../traces.js" */
/** @import { Hit, Sheet } from "../canvas.js" */

const LEVELS = 256;
/** Colours as a canvas keeps them: bytes of red, green, blue and opacity, as one number. */
const COLOURS = new Uint32Array(Uint8Array.from(Array.from({ length: LEVELS }, (_, level) => [...viridis(level / (LEVELS - 1)), 255]).flat()).buffer);
/** On which maps are painted, one after the other. */
const canvas = new OffscreenCanvas(1, 1);

/**
 * @param {Sheet} sheet
 * @param {HeatMap} map
 */
export function paint(sheet, map) {
  if ("look" in map) paintCells(sheet, map);
  else paintAmounts(sheet, map);
}

/**
 * @param {Sheet} sheet
 * @param {Amounts} map
 */
function paintAmounts({ pen, x, y }, map) {
  const [left, right] = ends(map.x).map((value) => x.at(value));
  const [bottom, top] = ends(map.y).map((value) => y.at(value));
  pen.save();
  pen.imageSmoothingEnabled = false;
  // Row 0 of the picture lies at the first y, wherever that is.
  pen.transform(Math.sign(right - left), 0, 0, Math.sign(top - bottom), left, bottom);
  pen.drawImage(picture(map), 0, 0, Math.abs(right - left), Math.abs(top - bottom));
  pen.restore();
}

/**
 * @param {Sheet} sheet
 * @param {HeatMap} map
 * @param {number} px
 * @param {number} py
 * @returns {Hit|null}
 */
export function near(sheet, map, px, py) {
  const { x, y, axes, unit } = sheet;
  if ("look" in map) {
    const { at, box } = cellsOf(sheet, map);
    const cell = at(px, py);
    return cell && { distance: REACH * unit, x: px, y: py, words: "", cell, box: box(cell) };
  }
  const [column, row] = [cellAt(map.x, x.value(px)), cellAt(map.y, y.value(py))];
  const value = map.values[row]?.[column] ?? null;
  if (value === null) return null;
  const [atX, atY] = [Number(map.x[column]), Number(map.y[row])];
  const words = saying(map, named(axes.x, atX), named(axes.y, atY), written(Number(value.toPrecision(3))));
  return { distance: REACH * unit, x: px, y: py, words };
}

/**
 * @param {HeatMap} map
 * @returns {HeatMap} For the key: from nothing to the largest.
 */
export function sample(map) {
  if ("look" in map) return map;
  const steps = Array.from({ length: 32 }, (_, step) => (step + 0.5) / 32);
  return { ...map, x: steps, y: [0.5], values: [steps.map((_, step) => step)] };
}

/** @param {Amounts} map */
export function most({ values }) {
  return values.reduce((most_, row) => row.reduce((/** @type {number} */ least, value) => Math.max(least, value ?? 0), most_), 0);
}

/**
 * One pixel a cell.
 *
 * @param {Amounts} map
 */
function picture(map) {
  const { values } = map;
  const [rows, columns] = [values.length, values[0]?.length ?? 0];
  canvas.width = Math.max(1, columns);
  canvas.height = Math.max(1, rows);
  const pen = /** @type {OffscreenCanvasRenderingContext2D} */ (canvas.getContext("2d"));
  const image = pen.createImageData(canvas.width, canvas.height);
  const cells = new Uint32Array(image.data.buffer);
  const scale = (LEVELS - 1) / (most(map) || 1);
  values.forEach((row, j) => {
    row.forEach((value, i) => {
      if (value === null) return;
      const level = Math.min(Math.max(Math.round(value * scale), 0), LEVELS - 1);
      cells[j * columns + i] = COLOURS[level];
    });
  });
  pen.putImageData(image, 0, 0);
  return canvas;
}

/**
 * From the edge of the first cell to that of the last.
 *
 * @param {readonly (number|null)[]} middles
 */
function ends(middles) {
  const [first, last] = [Number(middles[0]), Number(middles[middles.length - 1])];
  const half = middles.length > 1 ? (last - first) / (middles.length - 1) / 2 : 0.5;
  return [first - half, last + half];
}

/**
 * @param {readonly (number|null)[]} middles
 * @param {number} value
 */
function cellAt(middles, value) {
  const [first, last] = ends(middles);
  return Math.floor(((value - first) / (last - first)) * middles.length);
}
