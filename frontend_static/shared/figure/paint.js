/** Painting tools for traces: lines through many points, areas, and points in the shape of their ink. */

import { css, inkOn, viridis } from "../theme.js";
import { named, saying, written } from "./axes.js";

/** @import { Box, Scale } from "./axes.js" */
/** @import { Kind } from "./kinds.js" */
/** @import { Axis, Cell, CellLook, CellMap, HeatMap, Trace } from "./traces.js" */
/** @import { HeatMap as Amounts } from "./types.js" */

/** The sheet on which a panel's traces are painted.
 *
 * @typedef {object} Sheet
 * @property {CanvasRenderingContext2D} pen Scaled to px of the page.
 * @property {Box} box
 * @property {Scale} x
 * @property {Scale} y
 * @property {{x: Axis, y: Axis}} axes
 * @property {Record<string, string>} ink Colours by token.
 * @property {number} unit px of the page per px at letters of 16 px.
 * @property {boolean} cased Whether lines need a rim to stand out from the background.
 */

/** A hit of the pointer.
 *
 * @typedef {object} Hit
 * @property {number} distance px from the pointer.
 * @property {number} x px
 * @property {number} y px
 * @property {string} words
 * @property {number} [below] px, lower edge of a hit that has a height; `y` is its upper edge.
 * @property {Cell} [cell] Cell of a map with selectable cells.
 */

/** @typedef {"disc"|"ring"|"triangle"|"diamond"|"cross"|"square"} Shape */
/** @typedef {{ink: string, width: number, dash?: number[], opacity?: number}} Stroke Lengths in px at letters of 16 px. */

/** Reach of a pointer, px at letters of 16 px. Areas are at this distance, so that lines on them win. */
export const REACH = 14;
/** Total width of a rim, px at letters of 16 px. */
const RIM = 2.5;
/** Number of steps in which opacities are painted; each step is one path. */
const LEVELS = 12;
/** Number of points from which each is a copy of one picture: as fast, and translucent. */
const COPIED_FROM = 1500;
/** Width of the lines of a point's shape. */
const LINE = 1.5;
/** Points per column of pixels from which a line is thinned. */
const CROWDED = 4;
/** Half the length of the dash for a point without neighbours, px. */
const ALONE = 0.75;

/** The look of a colour with a meaning: a line has its own width and dashes, a point its own shape, so that they differ without colours,
 * too. Lengths in px at letters of 16 px.
 *
 * @type {Record<string, {width: number, dash: number[], shape: Shape}>}
 */
export const LOOKS = {
  estimate: { width: 2.5, dash: [], shape: "disc" },
  truth: { width: 1.75, dash: [], shape: "ring" },
  prediction: { width: 2.5, dash: [11, 4], shape: "triangle" },
  observation: { width: 3, dash: [11, 4, 3, 4], shape: "diamond" },
  lost: { width: 2.5, dash: [3, 3], shape: "cross" },
  second: { width: 2.5, dash: [18, 4], shape: "square" },
  hidden: { width: 1.5, dash: [], shape: "disc" },
};

/** Dashes of any line declared as dashed. */
export const DASHED = [5, 4];

/** Functions that add each shape to a path, around (x, y) with a radius. A cross and a ring are lines.
 *
 * @type {Record<Shape, (path: Path2D, x: number, y: number, radius: number) => void>}
 */
const SHAPES = {
  disc: (path, x, y, radius) => {
    path.moveTo(x + radius, y);
    path.arc(x, y, radius, 0, 2 * Math.PI);
  },
  ring: (path, x, y, radius) => SHAPES.disc(path, x, y, radius),
  triangle: (path, x, y, radius) => polygon(path, x, y, radius, [[0, -1.2], [1.1, 0.8], [-1.1, 0.8]]),
  diamond: (path, x, y, radius) => polygon(path, x, y, radius, [[0, -1.3], [1.3, 0], [0, 1.3], [-1.3, 0]]),
  cross: (path, x, y, radius) => {
    path.moveTo(x - radius, y - radius);
    path.lineTo(x + radius, y + radius);
    path.moveTo(x - radius, y + radius);
    path.lineTo(x + radius, y - radius);
  },
  square: (path, x, y, radius) => path.rect(x - 0.9 * radius, y - 0.9 * radius, 1.8 * radius, 1.8 * radius),
};

/** The colour of an ink: that of the theme's token, or itself.
 *
 * @param {Pick<Sheet, "ink">} sheet
 * @param {string} ink
 */
function colourOf(sheet, ink) {
  return sheet.ink[ink] ?? ink;
}

/**
 * @param {Sheet} sheet
 * @param {Path2D} path
 * @param {Stroke} look
 */
export function stroke(sheet, path, { ink, width, dash = [], opacity = 1 }) {
  const { pen, unit } = sheet;
  pen.save();
  pen.globalAlpha = opacity;
  pen.lineJoin = "round";
  pen.setLineDash(dash.map((length) => length * unit));
  if (sheet.cased) stroke({ ...sheet, cased: false }, path, { ink: "surface", width: width + RIM, dash, opacity });
  pen.strokeStyle = colourOf(sheet, ink);
  pen.lineWidth = width * unit;
  pen.stroke(path);
  pen.restore();
}

/**
 * @param {Sheet} sheet
 * @param {Path2D} path
 * @param {string} ink
 * @param {number} opacity
 */
export function fill(sheet, path, ink, opacity) {
  const { pen } = sheet;
  pen.save();
  pen.globalAlpha = opacity;
  pen.fillStyle = colourOf(sheet, ink);
  pen.fill(path);
  pen.restore();
}

/** Run `paint` clipped to the box, except for marks at its edge.
 *
 * @param {Pick<Sheet, "pen"|"box">} sheet
 * @param {number} over Overhang of these marks, px.
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

/** One path per step of opacity, the faintest first.
 *
 * @param {number} count
 * @param {number|readonly number[]} opacity One for all, or one for each.
 * @param {(index: number, path: Path2D) => unknown} add
 * @returns {[opacity: number, path: Path2D][]}
 */
export function byOpacity(count, opacity, add) {
  /** @type {Map<number, Path2D>} */
  const paths = new Map();
  for (let index = 0; index < count; index += 1) {
    const level = Math.ceil((typeof opacity === "number" ? opacity : opacity[index]) * LEVELS);
    const path = paths.get(level) ?? new Path2D();
    paths.set(level, path);
    add(index, path);
  }
  return [...paths].sort(([one], [other]) => one - other).map(([level, path]) => [level / LEVELS, path]);
}

/** Points in the shape of their ink; NaN is left out.
 *
 * @param {Sheet} sheet
 * @param {Float64Array} x px
 * @param {Float64Array} y px
 * @param {{ink: string, radius: number, shape?: Shape, opacity?: number|readonly number[]}} look The radius in px.
 */
export function points(sheet, x, y, { ink, radius, shape = LOOKS[ink].shape, opacity = 1 }) {
  const { pen } = sheet;
  const isKnown = (/** @type {number} */ index) => Number.isFinite(x[index] + y[index]);
  pen.save();
  if (x.length >= COPIED_FROM) {
    const side = 2 * Math.ceil(1.4 * radius + sheet.unit);
    const density = pen.getTransform().a;
    const picture = new OffscreenCanvas(side * density, side * density);
    const own = /** @type {CanvasRenderingContext2D} */ (/** @type {unknown} */ (picture.getContext("2d")));
    own.scale(density, density);
    const path = new Path2D();
    SHAPES[shape](path, side / 2, side / 2, radius);
    paintShape({ ...sheet, pen: own, cased: false }, path, shape, { ink, opacity: 1 });
    for (let index = 0; index < x.length; index += 1) {
      if (!isKnown(index)) continue;
      pen.globalAlpha = typeof opacity === "number" ? opacity : opacity[index];
      pen.drawImage(picture, x[index] - side / 2, y[index] - side / 2, side, side);
    }
  } else {
    const paths = byOpacity(x.length, opacity, (index, path) => isKnown(index) && SHAPES[shape](path, x[index], y[index], radius));
    for (const [share, path] of paths) paintShape(sheet, path, shape, { ink, opacity: share });
  }
  pen.restore();
}

/**
 * @param {Sheet} sheet
 * @param {Path2D} path
 * @param {Shape} shape
 * @param {{ink: string, opacity: number}} look
 */
function paintShape(sheet, path, shape, { ink, opacity }) {
  const isLine = ["ring", "cross"].includes(shape);
  if (isLine) stroke(sheet, path, { ink, width: LINE, opacity });
  else {
    if (sheet.cased) stroke({ ...sheet, cased: false }, path, { ink: "surface", width: RIM, opacity });
    fill(sheet, path, ink, opacity);
  }
}

/**
 * @param {Path2D} path
 * @param {number} x
 * @param {number} y
 * @param {number} radius
 * @param {readonly (readonly [number, number])[]} corners In radii.
 */
function polygon(path, x, y, radius, corners) {
  const [first, ...others] = corners.map(([dx, dy]) => /** @type {const} */ ([x + dx * radius, y + dy * radius]));
  path.moveTo(...first);
  for (const corner of others) path.lineTo(...corner);
  path.closePath();
}

/** A path through points with gaps at NaN. A point between gaps is a short dash.
 *
 * @param {Float64Array} x px
 * @param {Float64Array} y px
 */
export function pathThrough(x, y) {
  const path = new Path2D();
  const drawn = kept(x, y);
  const isKnown = (/** @type {number|undefined} */ index) => index !== undefined && Number.isFinite(x[index] + y[index]);
  drawn.forEach((index, place) => {
    if (!isKnown(index)) return;
    const [before, after] = [isKnown(drawn[place - 1]), isKnown(drawn[place + 1])];
    if (before) path.lineTo(x[index], y[index]);
    else path.moveTo(after ? x[index] : x[index] - ALONE, y[index]);
    if (!before && !after) path.lineTo(x[index] + ALONE, y[index]);
  });
  return path;
}

/** A path around the area between two lines, in pieces if one of them has a gap.
 *
 * @param {Float64Array} x px
 * @param {Float64Array} low px
 * @param {Float64Array} high px
 */
export function pathBetween(x, low, high) {
  const path = new Path2D();
  const isKnown = (/** @type {number} */ index) => Number.isFinite(x[index] + low[index] + high[index]);
  for (let from = 0; from < x.length; from += 1) {
    if (!isKnown(from)) continue;
    let to = from + 1;
    while (to < x.length && isKnown(to)) to += 1;
    const [above, below] = [high, low].map((edge) => kept(x.subarray(from, to), edge.subarray(from, to)).map((index) => index + from));
    if (to === from + 1) path.rect(x[from] - ALONE, Math.min(low[from], high[from]), 2 * ALONE, Math.abs(high[from] - low[from]));
    else {
      path.moveTo(x[from], high[from]);
      for (const index of above.slice(1)) path.lineTo(x[index], high[index]);
      for (const index of below.reverse()) path.lineTo(x[index], low[index]);
      path.closePath();
    }
    from = to;
  }
  return path;
}

/** Indices of the points to draw. If a line has more points than pixels, each column of pixels keeps its first, lowest, highest and last
 * point: the picture is the same.
 *
 * @param {Float64Array} x px
 * @param {Float64Array} y px
 * @returns {number[]}
 */
export function kept(x, y) {
  const width = x[x.length - 1] - x[0];
  const goesRight = () => x.every((value, index) => index === 0 || value >= x[index - 1]);
  if (!(x.length > CROWDED * Math.max(1, width)) || !goesRight()) return Array.from(x.keys());
  /** @type {number[]} */
  const found = [];
  for (let from = 0; from < x.length; ) {
    let [to, low, high] = [from, from, from];
    while (to + 1 < x.length && Math.floor(x[to + 1]) === Math.floor(x[from]) && Number.isFinite(y[to + 1])) {
      to += 1;
      if (y[to] < y[low]) low = to;
      if (y[to] > y[high]) high = to;
    }
    found.push(...new Set([from, Math.min(low, high), Math.max(low, high), to]));
    from = to + 1;
  }
  return found;
}

// Heat maps: amounts over a plane in viridis, or cells with individual looks, filled in proportion to their runs, and hatched if empty.

/** Extent from which cells have gaps between them. */
const APART_FROM_PX = 8;
const SMALLEST_TEXT_PX = 30;
/** Size of the letters in a cell, px, and as a share of the cell. */
const [SMALLEST_LETTERS, LARGEST_LETTERS, LETTERS] = [11, 17, 0.3];
const HATCH_EVERY_PX = 5;
/** Least filled share, so that a cell is visible from its first run. */
const LEAST_SIDE = 0.25;
const SHADES = 256;
/** Colours as a canvas keeps them: bytes of red, green, blue and opacity, as one number. */
const COLOURS = new Uint32Array(Uint8Array.from(Array.from({ length: SHADES }, (_, level) => [...viridis(level / (SHADES - 1)), 255]).flat()).buffer);

/** @type {Kind<HeatMap>} */
export const heatMap = {
  over: 0,
  paint: (sheet, map) => ("look" in map ? paintCells(sheet, map) : paintAmounts(sheet, map)),
  near(sheet, map, px, py) {
    const { x, y, axes, unit } = sheet;
    if ("look" in map) {
      const cell = cellsOf(sheet, map).at(px, py);
      return cell && cellHit(sheet, map, cell);
    }
    const [column, row] = [cellAt(map.x, x.value(px)), cellAt(map.y, y.value(py))];
    const value = map.values[row]?.[column] ?? null;
    if (value === null) return null;
    const [atX, atY] = [Number(map.x[column]), Number(map.y[row])];
    return { distance: REACH * unit, x: px, y: py, words: saying(map, named(axes.x, atX), named(axes.y, atY), written(Number(value.toPrecision(3)))) };
  },
};

/** @param {Amounts} map */
export function most({ values }) {
  return values.flat().reduce((/** @type {number} */ largest, value) => Math.max(largest, value ?? 0), 0);
}

/** A picture with one pixel per cell, enlarged to the cells.
 *
 * @param {Sheet} sheet
 * @param {Amounts} map
 */
function paintAmounts({ pen, x, y }, map) {
  const { values } = map;
  const image = new ImageData(Math.max(1, values[0]?.length ?? 0), Math.max(1, values.length));
  const cells = new Uint32Array(image.data.buffer);
  const scale = (SHADES - 1) / (most(map) || 1);
  values.flat().forEach((value, index) => {
    if (value !== null) cells[index] = COLOURS[Math.min(Math.max(Math.round(value * scale), 0), SHADES - 1)];
  });
  const picture = new OffscreenCanvas(image.width, image.height);
  picture.getContext("2d")?.putImageData(image, 0, 0);
  const [left, right] = edges(map.x).map((value) => x.at(value));
  const [bottom, top] = edges(map.y).map((value) => y.at(value));
  pen.save();
  pen.imageSmoothingEnabled = false;
  // Row 0 of the picture is at the first y.
  pen.transform(Math.sign(right - left), 0, 0, Math.sign(top - bottom), left, bottom);
  pen.drawImage(picture, 0, 0, Math.abs(right - left), Math.abs(top - bottom));
  pen.restore();
}

/** The range from the edge of the first cell to that of the last.
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
 * @param {Cell} cell
 * @returns {Hit}
 */
export function cellHit(sheet, map, cell) {
  const { left, top, width, height } = cellsOf(sheet, map).box(cell);
  return { distance: REACH * sheet.unit, x: left + width / 2, y: top, below: top + height, words: "", cell };
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
 * @param {string} family Font family.
 */
function paintCell(sheet, { left, top, width, height }, { colour, text, filled, isOutlined, isHatched }, family) {
  const { pen, ink } = sheet;
  const gap = Math.min(width, height) > APART_FROM_PX ? 1 : 0;
  const box = { left, top, width: width - gap, height: height - gap };
  const isWhole = filled === 1 && !isHatched;
  if (isHatched) within({ pen, box }, 0, () => hatch(pen, box, ink.line));
  else if (colour !== null && filled > 0) {
    // The filled area grows with the computed runs.
    const side = Math.max(Math.sqrt(filled), LEAST_SIDE);
    pen.fillStyle = css(colour);
    pen.fillRect(left + (box.width * (1 - side)) / 2, top + (box.height * (1 - side)) / 2, box.width * side, box.height * side);
  }
  if (!isWhole || colour === null || isOutlined) {
    pen.strokeStyle = ink.line;
    pen.lineWidth = 1;
    pen.strokeRect(left + 0.5, top + 0.5, box.width - 1, box.height - 1);
  }
  // Computed, but without a value: for example, no run succeeded.
  if (isWhole && colour === null) write(sheet, "–", ink.muted, box, family);
  else if (isWhole && colour !== null && text) write(sheet, text, inkOn(colour), box, family);
}

/** Write text into a cell, if there is room.
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

/** Hatch a cell that is and stays empty.
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
