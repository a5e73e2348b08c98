/** What traces are painted with: lines through many points, areas, and points in the shape of their ink. */

/** @import { Box } from "./axes.js" */
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
 */

/** @typedef {"disc"|"ring"|"triangle"|"diamond"|"cross"|"square"} Shape */
/** @typedef {{ink: string, width: number, dash?: number[], opacity?: number}} Stroke Lengths in px at letters of 16 px. */

/** Reach of a pointer, px at letters of 16 px. Areas are at this distance, so that lines on them win. */
export const REACH = 14;
/** How far the rim of what is cased stands out, in all, px at letters of 16 px. */
const RIM = 2.5;
/** Number of steps in which opacities are painted; each step is one path. */
const LEVELS = 12;
/** From this number of points on, each is a copy of one picture: as fast, and those below shine through. */
const COPIED_FROM = 1500;
/** Width of the lines that points are made of. */
const LINE = 1.5;
/** From this number of points per column of pixels on, a line is thinned. */
const CROWDED = 4;
/** Half the length of the dash for a point without neighbours, px. */
const ALONE = 0.75;

/**
 * How a colour with a meaning is drawn: a line has its own width and dashes, a point its own shape, so that they are told
 * apart without colours, too. Lengths in px at letters of 16 px.
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

/** Of what is said to be dashed, whatever its colour. */
export const DASHED = [5, 4];

/**
 * How each shape is added to a path, around (x, y) with a radius. A cross and a ring are lines.
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

/**
 * The colour of an ink: what it is called in the theme, or itself.
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
  if (sheet.cased) {
    pen.strokeStyle = sheet.ink.surface;
    pen.lineWidth = (width + RIM) * unit;
    pen.stroke(path);
  }
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

/**
 * Run `paint` with nothing painted outside of the box but marks that stand at its edge.
 *
 * @param {Pick<Sheet, "pen"|"box">} sheet
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
 * One path for all things that are about equally opaque, the faintest first.
 *
 * @param {number} count
 * @param {number|readonly number[]} opacity Of all or of each.
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

/**
 * Points in the shape of their ink; what is not a number is left out.
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
    const own = /** @type {OffscreenCanvasRenderingContext2D} */ (picture.getContext("2d"));
    own.scale(density, density);
    const path = new Path2D();
    SHAPES[shape](path, side / 2, side / 2, radius);
    paintShape({ ...sheet, cased: false }, own, path, shape, ink);
    for (let index = 0; index < x.length; index += 1) {
      if (!isKnown(index)) continue;
      pen.globalAlpha = typeof opacity === "number" ? opacity : opacity[index];
      pen.drawImage(picture, x[index] - side / 2, y[index] - side / 2, side, side);
    }
  } else {
    const paths = byOpacity(x.length, opacity, (index, path) => isKnown(index) && SHAPES[shape](path, x[index], y[index], radius));
    for (const [share, path] of paths) {
      pen.globalAlpha = share;
      paintShape(sheet, pen, path, shape, ink);
    }
  }
  pen.restore();
}

/**
 * @param {Sheet} sheet
 * @param {CanvasRenderingContext2D|OffscreenCanvasRenderingContext2D} pen
 * @param {Path2D} path
 * @param {Shape} shape
 * @param {string} ink
 */
function paintShape(sheet, pen, path, shape, ink) {
  const isLine = ["ring", "cross"].includes(shape);
  if (sheet.cased) {
    pen.strokeStyle = sheet.ink.surface;
    pen.lineWidth = (isLine ? LINE + RIM : RIM) * sheet.unit;
    pen.stroke(path);
  }
  pen.strokeStyle = pen.fillStyle = colourOf(sheet, ink);
  pen.lineWidth = LINE * sheet.unit;
  if (isLine) pen.stroke(path);
  else pen.fill(path);
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

/**
 * A path through points; what is not a number parts it. A point with nothing known at either side is a short dash.
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

/**
 * A path around what lies between two lines, in pieces where one of them has a gap.
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

/**
 * Numbers of the points that have to be drawn. Of a line that goes to the right through more points than pixels, each
 * column of pixels keeps its first, lowest, highest and last: the picture is the same.
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
