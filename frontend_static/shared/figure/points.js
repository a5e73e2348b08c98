/**
 * Points in the shape of their ink: each drawn by itself, or stamped into an image where there are thousands, which is as
 * fast and lets those below shine through.
 */

import { LOOKS } from "./line_styles.js";
import { RIM } from "./canvas.js";

/** @import { Ink, Shape } from "./line_styles.js" */
/** @import { Sheet } from "./canvas.js" */

/** @typedef {{x: Float64Array, y: Float64Array, opacity?: Float64Array}} Places px; what is not a number is left out. */

const STAMPED_FROM = 1500;
/** Opacities of single points are shown in so many steps. */
const LEVELS = 12;
const LINE = 1.5;
const BYTE = 255;

/** How each shape is added to a path, around (x, y) with a radius. A cross and a ring are lines.
 *
 * @type {Record<Shape, (path: Path2D, x: number, y: number, radius: number) => void>} */
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
 * @param {Sheet} sheet
 * @param {Places} places
 * @param {Ink} ink
 * @param {number} radius px
 */
export function paintPoints(sheet, places, ink, radius) {
  if (places.x.length >= STAMPED_FROM) stamp(sheet, places, ink, radius);
  else draw(sheet, places, ink, radius);
}

/**
 * Those that are equally opaque are one path.
 *
 * @param {Sheet} sheet
 * @param {Places} places
 * @param {Ink} ink
 * @param {number} radius
 */
function draw({ pen, unit, cased, ink: colours }, { x, y, opacity }, ink, radius) {
  /** @type {Map<number, Path2D>} */
  const paths = new Map();
  for (let index = 0; index < x.length; index += 1) {
    if (!Number.isFinite(x[index] + y[index])) continue;
    const level = opacity === undefined ? LEVELS : Math.ceil(opacity[index] * LEVELS);
    const path = paths.get(level) ?? new Path2D();
    paths.set(level, path);
    SHAPES[LOOKS[ink].shape](path, x[index], y[index], radius);
  }
  pen.save();
  for (const [level, path] of [...paths].sort(([one], [other]) => one - other)) {
    pen.globalAlpha = level / LEVELS;
    fill(pen, path, ink, colours, unit, cased);
  }
  pen.restore();
}

/**
 * @param {CanvasRenderingContext2D|OffscreenCanvasRenderingContext2D} pen
 * @param {Path2D} path
 * @param {Ink} ink
 * @param {Record<string, string>} colours
 * @param {number} unit
 * @param {boolean} cased
 */
function fill(pen, path, ink, colours, unit, cased) {
  const isLine = ["ring", "cross"].includes(LOOKS[ink].shape);
  if (cased) {
    pen.strokeStyle = colours.surface;
    pen.lineWidth = (isLine ? LINE + RIM : RIM) * unit;
    pen.stroke(path);
  }
  if (isLine) {
    pen.strokeStyle = colours[ink];
    pen.lineWidth = LINE * unit;
    pen.stroke(path);
  } else {
    pen.fillStyle = colours[ink];
    pen.fill(path);
  }
}

/**
 * Lay all points over each other in an image of the box, then that over the canvas.
 *
 * @param {Sheet} sheet
 * @param {Places} places
 * @param {Ink} ink
 * @param {number} radius
 */
function stamp({ pen, box, unit, ink: colours }, { x, y, opacity }, ink, radius) {
  const density = pen.getTransform().a;
  const brush = brushOf(ink, radius * density, unit * density, colours);
  const reach = (brush.width - 1) / 2;
  const [wide, high] = [Math.round(box.width * density) + 2 * reach + 1, Math.round(box.height * density) + 2 * reach + 1];
  const bare = new Float32Array(wide * high).fill(1);
  const offsets = Int32Array.from(brush.pixels, ({ dx, dy }) => dy * wide + dx);
  const covers = Float32Array.from(brush.pixels, ({ cover }) => cover);
  for (let index = 0; index < x.length; index += 1) {
    const left = Math.round((x[index] - box.left) * density);
    const top = Math.round((y[index] - box.top) * density);
    if (!(left >= 0 && top >= 0 && left <= wide - brush.width && top <= high - brush.width)) continue;
    const share = opacity === undefined ? 1 : opacity[index];
    const corner = top * wide + left;
    for (let at = 0; at < offsets.length; at += 1) bare[corner + offsets[at]] *= 1 - share * covers[at];
  }
  const image = new ImageData(wide, high);
  const pixels = new Uint32Array(image.data.buffer);
  for (let index = 0; index < bare.length; index += 1) {
    if (bare[index] < 1) pixels[index] = brush.colour | (Math.round((1 - bare[index]) * BYTE) << 24);
  }
  const layer = new OffscreenCanvas(wide, high);
  layer.getContext("2d")?.putImageData(image, 0, 0);
  pen.drawImage(layer, box.left - reach / density, box.top - reach / density, wide / density, high / density);
}

/**
 * What one point covers, in pixels from the upper left of its square, and its colour as a canvas keeps it, but opacity.
 *
 * @param {Ink} ink
 * @param {number} radius Pixels.
 * @param {number} unit Pixels.
 * @param {Record<string, string>} colours
 */
function brushOf(ink, radius, unit, colours) {
  const width = 2 * Math.ceil(1.4 * radius + unit) + 1;
  const pen = /** @type {OffscreenCanvasRenderingContext2D} */ (new OffscreenCanvas(width, width).getContext("2d", { willReadFrequently: true }));
  const path = new Path2D();
  SHAPES[LOOKS[ink].shape](path, width / 2, width / 2, radius);
  fill(pen, path, ink, colours, unit, false);
  const { data } = pen.getImageData(0, 0, width, width);
  const covers = Array.from({ length: width * width }, (_, at) => ({ dx: at % width, dy: Math.floor(at / width), cover: data[4 * at + 3] / BYTE }));
  const most = covers.reduce((best, { cover }, at) => (cover > covers[best].cover ? at : best), 0);
  const [red, green, blue] = data.subarray(4 * most, 4 * most + 3);
  return { width, pixels: covers.filter(({ cover }) => cover > 0), colour: red | (green << 8) | (blue << 16) };
}

/**
 * @param {Path2D} path
 * @param {number} x
 * @param {number} y
 * @param {number} radius
 * @param {readonly (readonly [number, number])[]} corners In radii.
 */
function polygon(path, x, y, radius, corners) {
  corners.forEach(([dx, dy], index) => {
    if (index === 0) path.moveTo(x + dx * radius, y + dy * radius);
    else path.lineTo(x + dx * radius, y + dy * radius);
  });
  path.closePath();
}
