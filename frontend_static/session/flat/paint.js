/**
 * Painting a drawing from the front: every primitive where `pftrack/rendering.py` puts it.
 *
 * A drawing counts its px from the centre of the top left pixel, a canvas from that pixel's corner. So at k pixels of the
 * canvas to the px, a position x lands on k (x + 1/2).
 */

import { paintEllipsoids, paintHeads } from "./bodies.js";
import { paintMesh } from "./mesh.js";
import { coated } from "./overlay.js";
import { css, placed } from "./pixels.js";
import { paintPoints } from "./points.js";

/** @import { Drawing, Primitive, Colour, Picture, Ellipse, Axes, Text } from "./decode.js" */

/**
 * Where and how it is painted.
 *
 * @typedef {object} Surface
 * @property {CanvasRenderingContext2D} context
 * @property {number} width Pixels of the canvas.
 * @property {number} height Pixels of the canvas.
 * @property {number} scale Pixels of the canvas per px of the drawing.
 * @property {number} density Pixels of the canvas per pixel of the page, more where its letters are larger.
 * @property {(key: number) => CanvasImageSource|undefined} picture
 */

const PAPER = "#fff";
const ELLIPSE_CORNERS = 72;
/** From here on the pixels of the picture are meant to be seen as such. */
const ENLARGED_FROM = 3;
/** As high as the letters of the film. */
const TEXT_PX = 11.7;
const FONT = 'system-ui, -apple-system, "Segoe UI", Roboto, "Liberation Sans", sans-serif';
/** As in the film, width from which on there is room for names that are written out, where letters are 12 px high. */
const TITLES_FROM_PX = 520;
/** How much of a line is before its position. */
const BEFORE = { start: 0, middle: 0.5, end: 1 };
const BRIGHT_FROM = 3 * 160;

/**
 * Paint a drawing.
 *
 * @param {Surface} surface
 * @param {Pick<Drawing, "primitives">} drawing
 * @param {(layer: string) => boolean} isShown
 * @param {import("./overlay.js").Coat|null} [coat] Where it is one of several that lie over each other.
 */
export function paint(surface, drawing, isShown, coat = null) {
  const { context, width, height } = surface;
  context.setTransform(1, 0, 0, 1, 0, 0);
  context.globalAlpha = 1;
  context.clearRect(0, 0, width, height);
  context.fillStyle = PAPER;
  if (coat === null || coat.isLowest) context.fillRect(0, 0, width, height);
  context.lineJoin = "round";
  context.lineCap = "round";
  for (const item of drawing.primitives) {
    const shown = coat === null ? item : coated(item, coat);
    if (shown !== null && isShown(item.layer)) paintPrimitive(surface, shown);
  }
}

/**
 * @param {Surface} surface
 * @param {Primitive} item
 */
function paintPrimitive(surface, item) {
  switch (item.kind) {
    case "picture":
      return paintPicture(surface, item);
    case "points":
      return paintPoints(surface, item);
    case "polyline":
      return strokes(surface, item, [item.positions]);
    case "links":
      return strokes(surface, item, separate(item.segments));
    case "arrows":
      strokes(surface, item, separate(item.segments));
      return paintHeads(surface, item);
    case "ellipsoids":
      return paintEllipsoids(surface, item);
    case "ellipse":
      return strokes(surface, item, outline(item));
    case "axes":
      return strokes(surface, item, rays(item));
    case "mesh":
      return paintMesh(surface, item);
    case "text":
      return paintText(surface, item);
    default:
      // A camera does not see itself, and what a newer server may draw besides is unknown.
      return undefined;
  }
}

/**
 * @param {Surface} surface
 * @param {Picture} item
 */
function paintPicture({ context, width, height, picture }, item) {
  const image = picture(item.image_rgb.key);
  if (image === undefined) return;
  const [rows, columns] = item.image_rgb.shape;
  context.imageSmoothingEnabled = Math.min(width / columns, height / rows) < ENLARGED_FROM;
  context.imageSmoothingQuality = "high";
  context.drawImage(image, 0, 0, width, height);
}

/**
 * Stroke open lines, positions one after the other; those that are not finite are left out.
 *
 * @param {Surface} surface
 * @param {{colour: Colour, width: number}} look
 * @param {Iterable<ArrayLike<number>>} lines
 */
function strokes({ context, scale, density }, { colour, width }, lines) {
  context.strokeStyle = css(colour);
  context.lineWidth = Math.max(density, width * scale);
  context.beginPath();
  for (const line of lines) {
    let begun = false;
    for (let at = 0; at + 2 < line.length; at += 3) {
      const x = placed(line[at], scale);
      const y = placed(line[at + 1], scale);
      if (!Number.isFinite(x + y)) continue;
      if (begun) context.lineTo(x, y);
      else context.moveTo(x, y);
      begun = true;
    }
  }
  context.stroke();
}

/**
 * @param {Float32Array} segments
 * @returns {Float32Array[]} Each by itself.
 */
function separate(segments) {
  return Array.from({ length: segments.length / 6 }, (_, at) => segments.subarray(6 * at, 6 * at + 6));
}

/**
 * An ellipse has as many corners as in the film, so that dashes are the same; a dashed one lacks every other side.
 *
 * @param {Ellipse} ellipse
 * @returns {number[][]}
 */
function outline({ centre: [x, y], half_axes: [ax, ay, bx, by], dashed }) {
  const corners = Array.from({ length: ELLIPSE_CORNERS + 1 }, (_, corner) => {
    const angle = (2 * Math.PI * corner) / ELLIPSE_CORNERS;
    const [cos, sin] = [Math.cos(angle), Math.sin(angle)];
    return [x + cos * ax + sin * bx, y + cos * ay + sin * by, 0];
  });
  if (!dashed) return [corners.flat()];
  return Array.from({ length: ELLIPSE_CORNERS / 2 }, (_, dash) => [...corners[2 * dash], ...corners[2 * dash + 1]]);
}

/**
 * @param {Axes} axes
 * @returns {number[][]}
 */
function rays({ origin: [x, y], rotation, length }) {
  return [0, 1, 2].map((axis) => [x, y, 0, x + length * rotation[axis], y + length * rotation[3 + axis], 0]);
}

/**
 * Write with a rim in the opposite brightness, so that it can be read on any picture.
 *
 * @param {Surface} surface
 * @param {Text} item
 */
function paintText({ context, width, scale, density }, { position, text, colour, anchor, title }) {
  const at = placed(position[0], scale);
  const y = placed(position[1], scale);
  if (!Number.isFinite(at + y)) return;
  const size = Math.max(density, scale);
  context.font = `500 ${TEXT_PX * size}px ${FONT}`;
  context.textAlign = "left";
  const words = title !== "" && width >= TITLES_FROM_PX * size ? title : text;
  const long = context.measureText(words).width;
  const rim = 2.5 * size;
  let x = at - BEFORE[anchor] * long;
  if (title !== "") x = Math.max(rim, Math.min(x, width - long - rim));
  context.textBaseline = "alphabetic";
  context.lineWidth = rim;
  context.strokeStyle = colour[0] + colour[1] + colour[2] < BRIGHT_FROM ? "#fff" : "#000";
  context.strokeText(words, x, y);
  context.fillStyle = css(colour);
  context.fillText(words, x, y);
}
