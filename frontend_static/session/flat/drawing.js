/** Reading a drawing in the form of `server/pftrack_server/sessions/worker/codec.py`. The arrays are views of the message: nothing is
 copied. */

import { html, signal } from "../../vendor/preact.js";

/** @import { Layer, World } from "../../shared/messages.js" */

// The shown layers of a session's drawings, as signals; views read them, panels switch them.

export class Layers {
  /** Legend of the painted drawing. */
  keys = signal(/** @type {readonly DrawnKey[]} */ ([]));

  /** @param {readonly Layer[]} [declared] The layers; any other layer is shown. */
  constructor(declared = []) {
    /** Layers that are visible from the front. */
    this.declared = declared.filter(({ role }) => role !== "through time");
    /** Whether each layer is shown, by name. */
    this.shown = signal(Object.fromEntries(declared.map(({ name, shown, role }) => [name, shown && role !== "through time"])));
  }

  /** @param {string} layer */
  isShown(layer) {
    return this.shown.value[layer] ?? true;
  }

  /**
   * @param {string} layer
   * @param {boolean} shown
   */
  set(layer, shown) {
    if (this.isShown(layer) !== shown) this.shown.value = { ...this.shown.peek(), [layer]: shown };
  }
}

/** The legend of the shown layers, each meaning once.
 *
 * @param {{layers: Layers}} props
 */
export function LayerLegend({ layers }) {
  const shown = layers.keys.value.filter(({ layer }) => layers.isShown(layer));
  const once = new Map(shown.map((key) => [`${key.colour} ${key.meaning}`, key]));
  const items = [...once].map(([name, { colour, meaning }]) =>
    html`<li key=${name} class="legend-key"><i style=${`background: var(--${colour})`}></i>${meaning}</li>`,
  );
  return html`<ul class="legend" aria-label="Legend">${items}</ul>`;
}

// Flat views that lie over each other, each in one colour: the lowest has the picture and the truth, the others only their trackers'
// beliefs.

/** @typedef {{tint: Colour, isLowest: boolean}} Coat Colour and role of a view that is one of several. */

/** Colour of the truth, as in films. */
const TRUTH = "0,0,0";

export class Overlay {
  /** Null for a view by itself. */
  coat = signal(/** @type {Coat|null} */ (null));

  /** @param {number} first The run's frame that is the common frame 0, from which captions count. */
  constructor(first) {
    this.first = first;
  }
}

/** A primitive as painted in a view that is one of several; nothing if the lowest view shows it for all.
 *
 * @param {Primitive} item
 * @param {Coat} coat
 * @returns {Primitive|null}
 */
export function coated(item, { tint, isLowest }) {
  if (item.kind === "picture") return isLowest ? item : null;
  if ("colours" in item) return { ...item, colours: item.colours.map((_, at) => tint[at % 3]) };
  if (!("colour" in item) || item.colour instanceof Uint8Array) return item;
  if (String(item.colour) === TRUTH) return isLowest ? item : null;
  return { ...item, colour: tint };
}

/** @typedef {[number, number, number]} Colour RGB, 0 to 255 */

/** The shared part of all primitives.
 *
 * @typedef {object} Named
 * @property {string} name The same from frame to frame.
 * @property {string} layer
 */

/** @typedef {Named & {kind: "picture", image_rgb: {key: number, shape: [number, number, number]}}} Picture */
/** @typedef {Named & {kind: "points", positions: Float32Array, colours: Uint8Array, size: number}} Points */
/** @typedef {Named & {kind: "polyline", positions: Float32Array, colour: Colour, width: number}} Polyline */
/** @typedef {Named & {kind: "links", segments: Float32Array, colour: Colour, width: number}} Links */
/** @typedef {Named & {kind: "arrows", segments: Float32Array, colour: Colour, width: number}} Arrows */
/**
 * @typedef {Named & {kind: "ellipsoids", centres: Float32Array, covariances: Float32Array, colours: Uint8Array,
 *     opacity: number, sigmas: number}} Ellipsoids
 */
/**
 * @typedef {Named & {kind: "ellipse", centre: Float32Array, half_axes: Float32Array, colour: Colour, width: number,
 *     dashed: boolean}} Ellipse
 */
/**
 * @typedef {Named & {kind: "axes", origin: Float32Array, rotation: Float32Array, length: number, colour: Colour,
 *     width: number}} Axes
 */
/**
 * @typedef {Named & {kind: "mesh", vertices: Float32Array, faces: Int32Array, colour: Colour|Uint8Array,
 *     opacity: number|Float32Array}} Mesh
 */
/**
 * @typedef {Named & {kind: "text", position: Float32Array, text: string, colour: Colour,
 *     anchor: "start"|"middle"|"end", title: string, point: Float32Array|null}} Text
 */
/** @typedef {Named & {kind: "frustum"}} Frustum Visible only in 3-D. */
/** @typedef {Picture|Points|Polyline|Links|Arrows|Ellipse|Ellipsoids|Axes|Mesh|Text|Frustum} Primitive */

/** @typedef {World & {ruler: number}} ShownWorld with the length of its ruler, in its unit */
/** @typedef {{world: ShownWorld, primitives: Primitive[]}} WorldDrawing Primitives in the world's coordinates. */

/** @typedef {{layer: string, colour: string, meaning: string}} DrawnKey A key of a legend; its colour is a token. */

/**
 * A drawing; lengths in px of its picture, all positions as (x, y, z) one after the other.
 *
 * @typedef {object} Drawing
 * @property {number} frame
 * @property {number} width
 * @property {number} height
 * @property {string} caption
 * @property {DrawnKey[]} legend Keys of the drawn colours, in order.
 * @property {Primitive[]} primitives In painting order.
 * @property {WorldDrawing[]} worlds Worlds next to the picture.
 * @property {Map<number, Uint8Array>} files Pictures in the message, JPEG files by key.
 * @property {import("../../shared/messages.js").SessionMessage[]} messages The session's messages up to it.
 */

const MAGIC = "pfd";
const VERSION = 2;
const START_BYTES = 8;
const RECORD_BYTES = 8;
const ALIGNMENT = 4;
const ARRAYS = { f4: Float32Array, i4: Int32Array, u1: Uint8Array };

/**
 * Read a message.
 *
 * @param {ArrayBuffer} message
 * @returns {Drawing}
 * @throws {Error} The message has another version than this page, or is not a drawing.
 */
export function decode(message) {
  const view = new DataView(message);
  const magic = String.fromCharCode(...new Uint8Array(message, 0, MAGIC.length));
  const version = view.getUint8(MAGIC.length);
  if (magic !== MAGIC) throw new Error(`Expected a drawing that begins with ${MAGIC}, got ${magic}`);
  if (version !== VERSION) throw new Error(`This page reads drawings of version ${VERSION}, the server sends version ${version}; reload the page`);
  const base = START_BYTES + view.getUint32(4, true);
  const text = new TextDecoder().decode(new Uint8Array(message, START_BYTES, base - START_BYTES));
  /** @param {string} _ @param {unknown} value */
  const withArray = (_, value) => (isReference(value) ? array(value, message, base) : value);
  const { arrays, ...drawing } = JSON.parse(text, withArray);
  return { ...drawing, files: files(message, view, base + arrays) };
}

/** @typedef {{type: keyof typeof ARRAYS, at: number, shape: number[]}} Reference */

/**
 * @param {unknown} value
 * @returns {value is Reference}
 */
function isReference(value) {
  return typeof value === "object" && value !== null && "shape" in value && "type" in value && Object.hasOwn(ARRAYS, String(value.type));
}

/**
 * @param {Reference} reference
 * @param {ArrayBuffer} message
 * @param {number} base Offset of the arrays.
 */
function array({ type, at, shape }, message, base) {
  return new ARRAYS[type](message, base + at, shape.reduce((product, extent) => product * extent, 1));
}

/**
 * @param {ArrayBuffer} message
 * @param {DataView} view
 * @param {number} start Offset of the files.
 * @returns {Map<number, Uint8Array>}
 */
function files(message, view, start) {
  /** @type {Map<number, Uint8Array>} */
  const found = new Map();
  for (let at = start; at < message.byteLength; ) {
    const length = view.getUint32(at + 4, true);
    found.set(view.getUint32(at, true), new Uint8Array(message, at + RECORD_BYTES, length));
    at += RECORD_BYTES + Math.ceil(length / ALIGNMENT) * ALIGNMENT;
  }
  return found;
}
