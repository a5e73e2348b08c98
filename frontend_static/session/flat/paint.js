/**
 * Painting a drawing from the front: every primitive where `pftrack/rendering.py` puts it.
 *
 * A drawing counts its px from the centre of the top left pixel, a canvas from that pixel's corner. So at k pixels of the canvas per px, a
 position x is at k (x + 1/2). Clouds are discs, or stamps of whole pixels if there are thousands. Meshes are painted from their furthest
 triangle to the nearest, shaded by their angle to the viewer, each in the mean colour of its corners; a triangle hides parts of the same
 mesh behind it. */

import { css } from "../../shared/theme.js";
import { coated } from "./drawing.js";

/** @import { Arrows, Axes, Colour, Drawing, Ellipse, Ellipsoids, Links, Mesh, Picture, Points, Polyline, Primitive, Text } from "./drawing.js" */

/** Largest coordinate, pixels of the canvas; beyond it browsers become slow. */
const FAR_PX = 30_000;

/** A coordinate on the canvas; NaN stays NaN.
 *
 * @param {number} value px of the drawing, from the centre of the first pixel
 * @param {number} scale Pixels of the canvas per px of the drawing.
 */
export function placed(value, scale) {
  return Math.min(Math.max(scale * (value + 0.5), -FAR_PX), FAR_PX);
}

/** The canvas and the scale of painting.
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
const CORNERS = 72;
/** Scale from which the pixels of the picture are shown as squares. */
const ENLARGED_FROM = 3;
/** Height of letters, as in films. */
const TEXT_PX = 11.7;
const FONT = 'system-ui, -apple-system, "Segoe UI", Roboto, "Liberation Sans", sans-serif';
/** Width from which there is room for full names with letters of 12 px, as in films. */
const TITLES_FROM_PX = 520;
/** Share of a line before its position. */
const BEFORE = { start: 0, middle: 0.5, end: 1 };
const BRIGHT_FROM = 3 * 160;

/**
 * Paint a drawing.
 *
 * @param {Surface} surface
 * @param {Pick<Drawing, "primitives">} drawing
 * @param {(layer: string) => boolean} isShown
 * @param {import("./drawing.js").Coat|null} [coat] Its colour and role among several views that lie over each other.
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
    if (shown !== null && isShown(item.layer)) PAINTERS[shown.kind]?.(surface, shown);
  }
}

/** Painters by kind of primitive; each gets only its own kind. A frustum is not painted, nor are kinds of a newer server.
 *
 * @type {{[kind: string]: {paint(surface: Surface, item: Primitive): void}["paint"]|undefined}}
 */
const PAINTERS = {
  picture: paintPicture,
  points: paintPoints,
  polyline: (surface, /** @type {Polyline} */ item) => strokes(surface, item, [item.positions]),
  links: (surface, /** @type {Links} */ item) => strokes(surface, item, separate(item.segments)),
  arrows: (surface, /** @type {Arrows} */ item) => {
    strokes(surface, item, separate(item.segments));
    paintHeads(surface, item);
  },
  ellipsoids: paintEllipsoids,
  ellipse: (surface, /** @type {Ellipse} */ item) => strokes(surface, item, outline(item)),
  axes: (surface, /** @type {Axes} */ item) => strokes(surface, item, rays(item)),
  mesh: paintMesh,
  text: paintText,
};

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
 * Stroke open lines, positions one after the other; positions that are not finite are gaps.
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
 * @returns {Float32Array[]} One array per segment.
 */
function separate(segments) {
  return Array.from({ length: segments.length / 6 }, (_, at) => segments.subarray(6 * at, 6 * at + 6));
}

/** The outline of an ellipse, with the same corners as in films, so that dashes match; a dashed one lacks every other side.
 *
 * @param {Ellipse} ellipse
 * @returns {number[][]}
 */
function outline({ centre: [x, y], half_axes: [ax, ay, bx, by], dashed }) {
  const corners = around([x, y], [ax, ay], [bx, by]);
  if (!dashed) return [corners.flat()];
  return Array.from({ length: CORNERS / 2 }, (_, dash) => [...corners[2 * dash], ...corners[2 * dash + 1]]);
}

/** The corners of the polygon of an ellipse; the first is repeated at the end.
 *
 * @param {readonly number[]} centre
 * @param {readonly number[]} one A half axis.
 * @param {readonly number[]} other The half axis conjugate to it.
 */
function around([x, y], [ax, ay], [bx, by]) {
  return Array.from({ length: CORNERS + 1 }, (_, corner) => {
    const angle = (2 * Math.PI * corner) / CORNERS;
    const [cos, sin] = [Math.cos(angle), Math.sin(angle)];
    return [x + cos * ax + sin * bx, y + cos * ay + sin * by, 0];
  });
}

/**
 * @param {Axes} axes
 * @returns {number[][]} A line from the origin to the end of each axis.
 */
export function rays({ origin, rotation, length }) {
  return [0, 1, 2].map((axis) => [...origin, ...[0, 3, 6].map((row, at) => origin[at] + length * rotation[row + axis])]);
}

/** Write text with a rim of the opposite brightness, readable on any picture.
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
  if (at >= 0 && at <= width) x = Math.max(rim, Math.min(x, width - long - rim));
  context.textBaseline = "alphabetic";
  context.lineWidth = rim;
  context.strokeStyle = colour[0] + colour[1] + colour[2] < BRIGHT_FROM ? "#fff" : "#000";
  context.strokeText(words, x, y);
  context.fillStyle = css(colour);
  context.fillText(words, x, y);
}

const STAMPED_FROM = 2000;
const OPAQUE = 0xff000000;

/**
 * @param {Surface} surface
 * @param {Points} item
 */
function paintPoints(surface, item) {
  const radius = Math.max(0.5 * surface.density, (item.size * surface.scale) / 2);
  if (item.positions.length / 3 >= STAMPED_FROM) stamp(surface, item, radius);
  else discs(surface, item, radius);
}

/** Consecutive points of one colour are one path.
 *
 * @param {Surface} surface
 * @param {Points} item
 * @param {number} radius
 */
function discs({ context, width, height, scale }, { positions, colours }, radius) {
  let shown = -1;
  context.beginPath();
  for (let at = 0; at < positions.length; at += 3) {
    const x = placed(positions[at], scale);
    const y = placed(positions[at + 1], scale);
    if (!(x > -radius && x < width + radius && y > -radius && y < height + radius)) continue;
    const colour = (colours[at] << 16) | (colours[at + 1] << 8) | colours[at + 2];
    if (colour !== shown) {
      context.fill();
      context.beginPath();
      context.fillStyle = css(colours.subarray(at, at + 3));
      shown = colour;
    }
    context.moveTo(x + radius, y);
    context.arc(x, y, radius, 0, 2 * Math.PI);
  }
  context.fill();
}

/**
 * Set the pixels around each point in an image of the cloud's extent, which is then laid over the canvas.
 *
 * @param {Surface} surface
 * @param {Points} item
 * @param {number} radius
 */
function stamp({ context, width, height, scale }, { positions, colours }, radius) {
  const reach = Math.max(0, Math.round(radius - 0.5));
  const [left, right] = covered(positions.filter((_, at) => at % 3 === 0), scale, reach, width);
  const [top, bottom] = covered(positions.filter((_, at) => at % 3 === 1), scale, reach, height);
  if (right <= left || bottom <= top) return;
  const [wide, high] = [right - left, bottom - top];
  const image = new ImageData(wide, high);
  const pixels = new Uint32Array(image.data.buffer);
  const halves = Array.from({ length: 2 * reach + 1 }, (_, row) => Math.floor(Math.sqrt(reach ** 2 - (row - reach) ** 2)));
  for (let at = 0; at < positions.length; at += 3) {
    const x = Math.floor(placed(positions[at], scale)) - left;
    const y = Math.floor(placed(positions[at + 1], scale)) - top - reach;
    const colour = OPAQUE | (colours[at + 2] << 16) | (colours[at + 1] << 8) | colours[at];
    halves.forEach((half, row) => {
      const start = wide * (y + row);
      if (y + row >= 0 && y + row < high) pixels.fill(colour, start + Math.max(x - half, 0), start + Math.max(Math.min(x + half + 1, wide), 0));
    });
  }
  const layer = new OffscreenCanvas(wide, high);
  layer.getContext("2d")?.putImageData(image, 0, 0);
  context.drawImage(layer, left, top);
}

/**
 * The part of a canvas that a cloud covers along one direction: its first pixel, and the one after its last.
 *
 * @param {Float32Array} places
 * @param {number} scale
 * @param {number} reach
 * @param {number} extent Extent of the canvas.
 */
function covered(places, scale, reach, extent) {
  const pixels = places.filter(Number.isFinite).map((place) => Math.floor(placed(place, scale)));
  return [Math.max(Math.min(extent, ...pixels) - reach, 0), Math.min(Math.max(0, ...pixels) + reach + 1, extent)];
}

const OUTLINE_PX = 1;
/** Length of an arrow's head in line widths, and its largest share of the arrow. */
const HEAD_WIDTHS = 6;
const HEAD_SHARE = 0.35;
const HALF_ANGLE = (24 * Math.PI) / 180;

/**
 * Paint the heads of arrows; their lines are painted like any others.
 *
 * @param {Surface} surface
 * @param {Arrows} item
 */
function paintHeads({ context, scale }, { segments, colour, width }) {
  context.fillStyle = css(colour);
  for (let at = 0; at < segments.length; at += 6) {
    const [x, y] = [segments[at + 3], segments[at + 4]];
    const [dx, dy] = [x - segments[at], y - segments[at + 1]];
    const length = Math.hypot(dx, dy);
    if (!Number.isFinite(length) || length === 0) continue;
    const head = Math.min(HEAD_SHARE * length, HEAD_WIDTHS * width) / length;
    const aside = head * Math.tan(HALF_ANGLE);
    fillCorners(context, scale, [
      [x, y],
      [x - head * dx - aside * dy, y - head * dy + aside * dx],
      [x - head * dx + aside * dy, y - head * dy - aside * dx],
    ]);
  }
}

/**
 * @param {Surface} surface
 * @param {Ellipsoids} item
 */
function paintEllipsoids({ context, scale, density }, { centres, covariances, colours, opacity, sigmas }) {
  context.lineWidth = Math.max(density, OUTLINE_PX * scale);
  for (let number = 0; 3 * number < centres.length; number += 1) {
    const [x, y] = [centres[3 * number], centres[3 * number + 1]];
    const [across, slope, rest] = root(covariances[9 * number], covariances[9 * number + 3], covariances[9 * number + 4]);
    if (!Number.isFinite(x + y + across + slope + rest)) continue;
    context.fillStyle = context.strokeStyle = css(colours.subarray(3 * number, 3 * number + 3));
    context.globalAlpha = opacity;
    fillCorners(context, scale, around([x, y], [sigmas * across, sigmas * slope], [0, sigmas * rest]));
    context.globalAlpha = 1;
    context.stroke();
  }
}

/**
 * @param {CanvasRenderingContext2D} context
 * @param {number} scale
 * @param {readonly number[][]} corners
 */
function fillCorners(context, scale, corners) {
  context.beginPath();
  for (const [x, y] of corners) context.lineTo(placed(x, scale), placed(y, scale));
  context.closePath();
  context.fill();
}

/**
 * The lower triangular root of a covariance in the picture, which may be flat.
 *
 * @param {number} first Variance along x.
 * @param {number} both Covariance.
 * @param {number} second Variance along y.
 */
function root(first, both, second) {
  const across = Math.sqrt(Math.max(first, 0));
  const slope = across > 0 ? both / across : 0;
  return [across, slope, Math.sqrt(Math.max(second - slope * slope, 0))];
}

/** Share of its brightness that a triangle seen from its edge keeps. */
const AMBIENT = 0.4;
/** Overlap of triangles, pixels of the canvas, so that nothing shines through between them. */
const OVERLAP_PX = 0.5;

/**
 * @param {Surface} surface
 * @param {Mesh} mesh
 */
function paintMesh({ context, width, height, scale }, mesh) {
  const { vertices, faces } = mesh;
  if (!faces.length || !vertices.every(Number.isFinite)) return;
  const layer = new OffscreenCanvas(width, height);
  const target = layer.getContext("2d");
  if (target === null) return;
  target.lineWidth = OVERLAP_PX;
  target.lineJoin = "round";
  const { opacity } = mesh;
  const nearness = (/** @type {number} */ face) => [0, 1, 2].reduce((sum, corner) => sum + vertices[3 * faces[3 * face + corner] + 2], 0);
  for (const face of farToNear(faces.length / 3, nearness)) {
    const [a, b, c] = [faces[3 * face], faces[3 * face + 1], faces[3 * face + 2]];
    const light = AMBIENT + (1 - AMBIENT) * facing(vertices, a, b, c);
    target.fillStyle = target.strokeStyle = css(colourOf(mesh, a, b, c).map((value) => value * light));
    target.beginPath();
    for (const corner of [a, b, c]) target.lineTo(placed(vertices[3 * corner], scale), placed(vertices[3 * corner + 1], scale));
    target.closePath();
    if (typeof opacity !== "number") {
      target.globalCompositeOperation = "destination-out";
      target.globalAlpha = 1;
      target.fill();
      target.globalCompositeOperation = "source-over";
      target.globalAlpha = (opacity[a] + opacity[b] + opacity[c]) / 3;
      target.fill();
      continue;
    }
    target.fill();
    target.stroke();
  }
  context.globalAlpha = typeof opacity === "number" ? opacity : 1;
  context.drawImage(layer, 0, 0);
  context.globalAlpha = 1;
}

/**
 * Numbers from 0 to a count, the furthest from the viewer first.
 *
 * @param {number} count
 * @param {(number: number) => number} height Height towards the viewer.
 */
export function farToNear(count, height) {
  const heights = Float64Array.from({ length: count }, (_, number) => height(number));
  return [...heights.keys()].sort((one, other) => heights[one] - heights[other]);
}

/**
 * Share of a triangle's normal that points to the viewer, whichever side is seen.
 *
 * @param {Float32Array} vertices
 * @param {number} a
 * @param {number} b
 * @param {number} c
 */
function facing(vertices, a, b, c) {
  const edge = (/** @type {number} */ to, /** @type {number} */ axis) => vertices[3 * to + axis] - vertices[3 * a + axis];
  const x = edge(b, 1) * edge(c, 2) - edge(b, 2) * edge(c, 1);
  const y = edge(b, 2) * edge(c, 0) - edge(b, 0) * edge(c, 2);
  const z = edge(b, 0) * edge(c, 1) - edge(b, 1) * edge(c, 0);
  return Math.abs(z) / Math.max(Math.hypot(x, y, z), 1e-12);
}

/**
 * @param {Mesh} mesh
 * @param {number} a
 * @param {number} b
 * @param {number} c
 * @returns {number[]}
 */
function colourOf({ colour }, a, b, c) {
  if (colour.length === 3) return [...colour];
  return [0, 1, 2].map((channel) => (colour[3 * a + channel] + colour[3 * b + channel] + colour[3 * c + channel]) / 3);
}
