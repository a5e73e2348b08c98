/** A world next to the picture, which people can turn, enlarge or fold; its canvas is the only tab stop, also for its sides. Its primitives
 are projected to a square picture as in `pftrack/vision/rendering.py`: without perspective, so each primitive keeps its kind. */

import { IconButton, step } from "../../shared/dom.js";
import { enlargement, onTheme, watchCanvasSize } from "../../shared/theme.js";
import { h, html, useEffect, useLayoutEffect, useRef, useSignal } from "../../vendor/preact.js";
import { farToNear, paint, rays } from "./paint.js";

/** @import { Viewpoint } from "../../shared/messages.js" */
/** @import { Colour, Primitive, ShownWorld, WorldDrawing } from "./drawing.js" */

/** @typedef {[number, number, number]} Vector */

/** A map from a world to a picture: scale times rotation times the offset from the middle, plus the middle of the picture.
 *
 * @typedef {object} Projection
 * @property {Vector[]} turn World directions that point right, down and towards the viewer.
 * @property {Vector} middle Middle of the world, in its unit.
 * @property {number} scale px of the picture per unit.
 * @property {number} centre Position of the middle in the picture, px from the left and from the top.
 */

/** Factor of free space around a world. */
const MARGIN = 1.04;
/** Distance of a ruler from the picture's corner, as a share of the side. */
const RULER_MARGIN = 0.04;
const TEXT_ABOVE_PX = 5;
/** @type {Colour} */
const RULER_COLOUR = [128, 128, 128];
const RADIANS = Math.PI / 180;

/** The projection with which a world fills a square picture.
 *
 * @param {ShownWorld} world
 * @param {number} azimuth Degrees to the right of the front.
 * @param {number} elevation Degrees above the middle.
 * @param {number} side Side of the picture, px.
 * @returns {Projection}
 */
function projection(world, azimuth, elevation, side) {
  const [up, front] = [unit(world.up), unit(world.front)];
  const right = cross(up, front);
  const [a, e] = [azimuth * RADIANS, elevation * RADIANS];
  const across = sum(Math.cos(a), right, -Math.sin(a), front);
  const towards = sum(Math.cos(e), sum(Math.cos(a), front, Math.sin(a), right), Math.sin(e), up);
  return {
    turn: [across, cross(across, towards), towards],
    middle: world.middle,
    scale: side / (2 * MARGIN * world.radius),
    centre: (side - 1) / 2,
  };
}

/**
 * A world's ruler, in the lower left corner of its picture.
 *
 * @param {ShownWorld} world
 * @param {number} scale px of the picture per unit.
 * @param {number} side Side of the picture, px.
 * @returns {Primitive[]}
 */
function ruler(world, scale, side) {
  const left = RULER_MARGIN * side;
  const low = side - 1 - left;
  const segments = new Float32Array([left, low, 0, left + world.ruler * scale, low, 0]);
  const position = new Float32Array([left, low - TEXT_ABOVE_PX, 0]);
  const look = { layer: "ruler", colour: RULER_COLOUR };
  return [
    { ...look, kind: "links", name: "ruler", segments, width: 2 },
    { ...look, kind: "text", name: "ruler length", position, text: `${world.ruler} ${world.unit}`, anchor: "start", title: "", point: null },
  ];
}

/** Project a primitive of a world; points of clouds are sorted, the furthest first, so that the nearest is on top.
 *
 * @param {Projection} view
 * @param {Primitive} item
 * @returns {Primitive}
 */
function projected(view, item) {
  if (item.kind === "points") {
    const positions = places(view, item.positions);
    const order = byDepth(positions);
    return { ...item, positions: picked(positions, order, 3), colours: picked(item.colours, order, 3), size: item.size * view.scale };
  }
  if (item.kind === "ellipsoids") {
    const centres = places(view, item.centres);
    const order = byDepth(centres);
    const covariances = turnedSpreads(view, picked(item.covariances, order, 9));
    return { ...item, centres: picked(centres, order, 3), covariances, colours: picked(item.colours, order, 3) };
  }
  if (item.kind === "axes") return { ...item, kind: "links", segments: places(view, rays(item).flat()) };
  if (item.kind === "text") return { ...item, position: places(view, item.position), point: item.point && places(view, item.point) };
  if ("positions" in item) return { ...item, positions: places(view, item.positions) };
  if ("segments" in item) return { ...item, segments: places(view, item.segments) };
  return "vertices" in item ? { ...item, vertices: places(view, item.vertices) } : item;
}

/**
 * @param {Projection} view
 * @param {ArrayLike<number>} positions One after the other.
 * @returns {Float32Array}
 */
function places({ turn, middle: [mx, my, mz], scale, centre }, positions) {
  const mapped = new Float32Array(positions.length);
  turn.forEach(([a, b, c], axis) => {
    const origin = axis < 2 ? centre : 0;
    for (let at = 0; at < positions.length; at += 3) {
      mapped[at + axis] = scale * (a * (positions[at] - mx) + b * (positions[at + 1] - my) + c * (positions[at + 2] - mz)) + origin;
    }
  });
  return mapped;
}

/** Projected covariances, nine numbers each, px^2.
 *
 * @param {Projection} view
 * @param {Float32Array} covariances
 */
function turnedSpreads({ turn, scale }, covariances) {
  return covariances.map((_, at) => {
    const first = at - (at % 9);
    const [one, other] = [turn[Math.floor((at - first) / 3)], turn[at % 3]];
    let total = 0;
    for (let entry = 0; entry < 9; entry += 1) total += one[Math.floor(entry / 3)] * covariances[first + entry] * other[entry % 3];
    return scale * scale * total;
  });
}

/** Indices of positions, the furthest first.
 *
 * @param {Float32Array} positions
 */
function byDepth(positions) {
  return farToNear(positions.length / 3, (number) => positions[3 * number + 2]);
}

/**
 * Rows of an array in another order.
 *
 * @template {Float32Array|Uint8Array} T
 * @param {T} values
 * @param {readonly number[]} order
 * @param {number} width Length of a row.
 * @returns {T}
 */
function picked(values, order, width) {
  return /** @type {T} */ (values.map((_, at) => values[width * order[Math.floor(at / width)] + (at % width)]));
}

/** @param {Vector} vector @returns {Vector} */
function unit([x, y, z]) {
  const length = Math.hypot(x, y, z);
  return [x / length, y / length, z / length];
}

/** @param {Vector} one @param {Vector} other @returns {Vector} */
function cross([a, b, c], [x, y, z]) {
  return [b * z - c * y, c * x - a * z, a * y - b * x];
}

/** @param {number} share @param {Vector} one @param {number} rest @param {Vector} other @returns {Vector} */
function sum(share, one, rest, other) {
  return [share * one[0] + rest * other[0], share * one[1] + rest * other[1], share * one[2] + rest * other[2]];
}

const DEGREES_PER_PX = 0.6;
const DEGREES_PER_KEY = 10;
const HINT = "Drag to turn; arrow keys, too, and Enter for the next side";

/** @typedef {{azimuth: number, elevation: number}} Direction Viewing direction of a world, degrees. */

/**
 * @param {number} azimuth Beyond half a turn it continues from the other side.
 * @param {number} elevation Not beyond the top.
 * @returns {Direction}
 */
function direction(azimuth, elevation) {
  return { azimuth: ((azimuth + 540) % 360) - 180, elevation: Math.min(Math.max(elevation, -90), 90) };
}

/** @param {Viewpoint} viewpoint */
function directionOf({ azimuth_deg: azimuth, elevation_deg: elevation }) {
  return direction(azimuth, elevation);
}

/** @param {{drawn: WorldDrawing, isShown: (layer: string) => boolean}} props */
export function WorldView({ drawn, isShown }) {
  const { world } = drawn;
  const seen = useSignal(directionOf(world.viewpoints[0]));
  const isLarge = useSignal(false);
  const { azimuth, elevation } = seen.value;
  const [right, above] = [Math.round(azimuth), Math.round(elevation)];
  const [place, canvas] = usePainting(drawn, isShown, seen.value);
  const sides = world.viewpoints.map(directionOf);
  const shown = sides.findIndex((each) => each.azimuth === azimuth && each.elevation === elevation);
  const turning = useTurning(seen, sides[(shown + 1) % sides.length]);
  const buttons = world.viewpoints.map(({ name, title }, at) => {
    const look = () => (seen.value = sides[at]);
    return html`<button type="button" tabindex="-1" aria-pressed=${at === shown} data-viewpoint=${name} onClick=${look}>${title}</button>`;
  });
  const from = `${right} degrees to the right, ${above} above`;
  const label = `${world.title}, in ${world.unit}, seen from ${from}; arrow keys turn it, and Enter shows the next side`;
  const enlarge = { name: /** @type {const} */ ("enlarge"), title: "Larger", run: () => (isLarge.value = !isLarge.value) };
  return html`<details class="world" open data-world=${world.name} data-large=${isLarge.value ? "" : null}>
    <summary>${world.title}, ${world.unit}</summary>
    ${h(IconButton, { ...enlarge, class: "world-size quiet", "aria-pressed": isLarge.value })}
    <div class="world-sides" role="group" aria-label=${`Sides of ${world.title}`}>${buttons}</div>
    <div class="world-place small-print" ref=${place}>
      <canvas ref=${canvas} class="world-canvas" role="img" tabindex="0" title=${HINT} aria-label=${label}
        data-azimuth=${right} data-elevation=${above} ...${turning}></canvas>
    </div>
  </details>`;
}

/** A canvas that fills its place and is painted whenever its world is rendered, together with the picture.
 *
 * @param {WorldDrawing} drawn
 * @param {(layer: string) => boolean} isShown
 * @param {Direction} seen
 */
function usePainting(drawn, isShown, { azimuth, elevation }) {
  const place = useRef(/** @type {HTMLElement|null} */ (null));
  const canvas = useRef(/** @type {HTMLCanvasElement|null} */ (null));
  /** Side of the canvas, pixels of the display. */
  const pixels = useRef(0);
  const paintNow = useRef(() => {});
  paintNow.current = () => {
    const context = canvas.current?.getContext("2d", { alpha: false });
    if (!context || !place.current || pixels.current === 0) return;
    if (context.canvas.width !== pixels.current) context.canvas.width = context.canvas.height = pixels.current;
    paintWorld(context, drawn, azimuth, elevation, isShown, devicePixelRatio * enlargement(place.current));
  };
  useLayoutEffect(() => paintNow.current());
  useEffect(() => {
    const end = new AbortController();
    const around = /** @type {HTMLElement} */ (place.current);
    // At once: until the next frame of the display the canvas would be shown at its old size.
    const fit = (/** @type {number} */ side) => {
      pixels.current = side;
      paintNow.current();
    };
    watchCanvasSize(around, ({ width, height }) => fit(Math.min(width, height)), end.signal);
    // For printing the size changes, and no observer reports that.
    onTheme(() => fit(Math.round(around.clientWidth * devicePixelRatio)), end.signal);
    return () => end.abort();
  }, []);
  return /** @type {const} */ ([place, canvas]);
}

/** Turning by pointer and keys: the world follows the pointer, so the viewer moves the other way.
 *
 * @param {import("../../vendor/preact.js").Signal<Direction>} seen
 * @param {Direction} next The side that Enter shows.
 */
function useTurning(seen, next) {
  const held = useRef({ clientX: 0, clientY: 0 });
  /** @param {number} right @param {number} up */
  const turn = (right, up) => {
    const { azimuth, elevation } = seen.peek();
    seen.value = direction(azimuth + right, elevation + up);
  };
  return {
    onPointerDown: (/** @type {PointerEvent & {currentTarget: HTMLElement}} */ event) => {
      event.currentTarget.setPointerCapture(event.pointerId);
      held.current = event;
    },
    onPointerMove: (/** @type {PointerEvent & {currentTarget: HTMLElement}} */ event) => {
      if (!event.currentTarget.hasPointerCapture(event.pointerId)) return;
      turn(DEGREES_PER_PX * (held.current.clientX - event.clientX), DEGREES_PER_PX * (event.clientY - held.current.clientY));
      held.current = event;
    },
    onKeyDown: (/** @type {KeyboardEvent} */ event) => {
      // Without the focus here, the arrow keys move through the run.
      const way = step(event);
      if (way !== null) turn(DEGREES_PER_KEY * way[0], -DEGREES_PER_KEY * way[1]);
      else if (step(event, { Enter: [0, 0] })) seen.value = next;
    },
  };
}

/**
 * Paint a world on a square canvas.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {WorldDrawing} drawn
 * @param {number} azimuth
 * @param {number} elevation
 * @param {(layer: string) => boolean} isShown
 * @param {number} density Pixels of the canvas per px of the drawing.
 */
export function paintWorld(context, { world, primitives }, azimuth, elevation, isShown, density) {
  const { width, height } = context.canvas;
  const side = width / density;
  const view = projection(world, azimuth, elevation, side);
  const surface = { context, width, height, scale: density, density, picture: () => undefined };
  paint(surface, { primitives: [...primitives.map((item) => projected(view, item)), ...ruler(world, view.scale, side)] }, isShown);
}
