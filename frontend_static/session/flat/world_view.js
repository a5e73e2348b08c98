/**
 * A world beside the picture, which one turns, enlarges or folds; its canvas is the stop of the tab key for its sides, too. And how
 * its primitives become those of a square picture, as `pftrack/vision/rendering.py` has them: there is no perspective, so each
 * primitive stays one of its kind.
 */

import { build, icon } from "../../shared/dom.js";
import { enlargement, onTheme, watchCanvasSize } from "../../shared/theme.js";
import { coalesce } from "../../shared/timing.js";
import { paint } from "./paint.js";

/** @import { Viewpoint } from "../../shared/messages.js" */
/** @import { Axes, Colour, Ellipsoids, Layers, Points, Primitive, ShownWorld, WorldDrawing } from "./drawing.js" */

/** @typedef {[number, number, number]} Vector */

/**
 * A map from a world to a picture: scale times turn times the way from the middle, and then to the middle of the picture.
 *
 * @typedef {object} Projection
 * @property {Vector[]} turn Directions that are seen to the right, downwards and towards the viewer.
 * @property {Vector} middle Of the world, in its unit.
 * @property {number} scale px of the picture per unit.
 * @property {number} centre Where the middle is in the picture, px from the left and from the top.
 */

/** Factor of free space around a world. */
const MARGIN = 1.04;
/** How far from the corner of its picture a ruler lies, as a share of the side. */
const RULER_MARGIN = 0.04;
const TEXT_ABOVE_PX = 5;
/** @type {Colour} */
const RULER_COLOUR = [128, 128, 128];
const RADIANS = Math.PI / 180;

/**
 * How a world fills a square picture.
 *
 * @param {ShownWorld} world
 * @param {number} azimuth Degrees to the right of the front from where it is seen.
 * @param {number} elevation Degrees above the middle.
 * @param {number} side Of the picture, px.
 * @returns {Projection}
 */
export function projection(world, azimuth, elevation, side) {
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
 * Map the primitives of a world; clouds are put in order, the furthest first, so that the nearest lies on top.
 *
 * @param {Projection} view
 * @param {readonly Primitive[]} items
 * @returns {Primitive[]}
 */
export function projected(view, items) {
  return items.map((item) => primitive(view, item));
}

/**
 * A world's ruler, in the lower left corner of its picture.
 *
 * @param {ShownWorld} world
 * @param {Projection} view
 * @param {number} side Of the picture, px.
 * @returns {Primitive[]}
 */
export function ruler(world, view, side) {
  const left = RULER_MARGIN * side;
  const low = side - 1 - left;
  const segments = new Float32Array([left, low, 0, left + world.ruler * view.scale, low, 0]);
  const position = new Float32Array([left, low - TEXT_ABOVE_PX, 0]);
  const look = { layer: "ruler", colour: RULER_COLOUR };
  return [
    { ...look, kind: "links", name: "ruler", segments, width: 2 },
    { ...look, kind: "text", name: "ruler length", position, text: `${world.ruler} ${world.unit}`, anchor: "start", title: "", point: null },
  ];
}

/**
 * @param {Projection} view
 * @param {Primitive} item
 * @returns {Primitive}
 */
function primitive(view, item) {
  switch (item.kind) {
    case "points":
      return farToNear(view, item);
    case "ellipsoids":
      return spread(view, item);
    case "polyline":
      return { ...item, positions: places(view, item.positions) };
    case "links":
    case "arrows":
      return { ...item, segments: places(view, item.segments) };
    case "mesh":
      return { ...item, vertices: places(view, item.vertices) };
    case "text":
      return { ...item, position: places(view, item.position), point: item.point && places(view, item.point) };
    case "axes":
      return turnedAxes(view, item);
    default:
      return item;
  }
}

/**
 * @param {Projection} view
 * @param {Float32Array} positions One after the other.
 * @returns {Float32Array}
 */
function places({ turn: [right, down, towards], middle: [mx, my, mz], scale, centre }, positions) {
  const mapped = new Float32Array(positions.length);
  for (let at = 0; at < positions.length; at += 3) {
    const [x, y, z] = [positions[at] - mx, positions[at + 1] - my, positions[at + 2] - mz];
    mapped[at] = scale * (right[0] * x + right[1] * y + right[2] * z) + centre;
    mapped[at + 1] = scale * (down[0] * x + down[1] * y + down[2] * z) + centre;
    mapped[at + 2] = scale * (towards[0] * x + towards[1] * y + towards[2] * z);
  }
  return mapped;
}

/**
 * @param {Projection} view
 * @param {Points} item
 * @returns {Points}
 */
function farToNear(view, item) {
  const positions = places(view, item.positions);
  const order = byDepth(positions);
  return { ...item, positions: picked(positions, order, 3), colours: picked(item.colours, order, 3), size: item.size * view.scale };
}

/**
 * @param {Projection} view
 * @param {Ellipsoids} item
 * @returns {Ellipsoids}
 */
function spread(view, item) {
  const centres = places(view, item.centres);
  const order = byDepth(centres);
  const covariances = new Float32Array(item.covariances.length);
  for (let at = 0; at < covariances.length; at += 9) {
    const seen = turnedSpread(view, item.covariances.subarray(at, at + 9));
    covariances.set(seen, at);
  }
  return { ...item, centres: picked(centres, order, 3), covariances: picked(covariances, order, 9), colours: picked(item.colours, order, 3) };
}

/**
 * A covariance, nine numbers row by row, as it is seen, px^2.
 *
 * @param {Projection} view
 * @param {ArrayLike<number>} covariance
 */
function turnedSpread({ turn, scale }, covariance) {
  /** @param {Vector} one @param {Vector} other */
  const between = (one, other) => {
    let total = 0;
    for (let row = 0; row < 3; row += 1) for (let column = 0; column < 3; column += 1) total += one[row] * covariance[3 * row + column] * other[column];
    return scale * scale * total;
  };
  return turn.flatMap((one) => turn.map((other) => between(one, other)));
}

/**
 * @param {Projection} view
 * @param {Axes} item
 * @returns {Axes}
 */
function turnedAxes(view, item) {
  const rotation = new Float32Array(9);
  view.turn.forEach((direction, row) => {
    for (let axis = 0; axis < 3; axis += 1) {
      rotation[3 * row + axis] = direction[0] * item.rotation[axis] + direction[1] * item.rotation[3 + axis] + direction[2] * item.rotation[6 + axis];
    }
  });
  return { ...item, origin: places(view, item.origin), rotation, length: item.length * view.scale };
}

/**
 * Numbers of positions, the furthest first.
 *
 * @param {Float32Array} positions
 */
function byDepth(positions) {
  const order = Array.from({ length: positions.length / 3 }, (_, number) => number);
  return order.sort((one, other) => positions[3 * one + 2] - positions[3 * other + 2]);
}

/**
 * Rows of an array in another order.
 *
 * @template {Float32Array|Uint8Array} T
 * @param {T} values
 * @param {readonly number[]} order
 * @param {number} width Of a row.
 * @returns {T}
 */
function picked(values, order, width) {
  const taken = /** @type {T} */ (values.slice());
  order.forEach((from, to) => taken.set(values.subarray(width * from, width * (from + 1)), width * to));
  return taken;
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
/** @type {Record<string, [azimuth: number, elevation: number]>} */
const TURNS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

export class WorldView {
  #layers;
  /** @type {WorldDrawing} */
  #drawn;
  #azimuth = 0;
  #elevation = 0;
  /** Side of the canvas, pixels of the display. */
  #side = 0;
  #soon;
  #end = new AbortController();
  #canvas = build("canvas", { class: "world-canvas", role: "img", tabindex: 0, title: HINT });
  #place = build("div", { class: "world-place small-print" }, this.#canvas);
  /** @type {Map<string, HTMLButtonElement>} */
  #buttons;
  #size = build(
    "button",
    { type: "button", class: "world-size quiet", title: "Larger", "aria-label": "Larger", "aria-pressed": "false", on: { click: () => this.#resize() } },
    icon("enlarge"),
  );

  /**
   * @param {WorldDrawing} drawn The first that it shows.
   * @param {Layers} layers
   * @param {AbortSignal} signal
   */
  constructor(drawn, layers, signal) {
    const { world } = drawn;
    this.#drawn = drawn;
    this.#layers = layers;
    this.#soon = coalesce(() => this.#paint(), this.#end.signal);
    this.#buttons = new Map(world.viewpoints.map((viewpoint) => [viewpoint.name, this.#button(viewpoint)]));
    this.element = build(
      "details",
      { class: "world", open: true, data: { world: world.name } },
      build("summary", {}, `${world.title}, ${world.unit}`),
      this.#size,
      build("div", { class: "world-sides", role: "group", "aria-label": `Sides of ${world.title}` }, [...this.#buttons.values()]),
      this.#place,
    );
    this.#look(world.viewpoints[0]);
    this.#turnByHand();
    signal.addEventListener("abort", () => this.#end.abort());
    watchCanvasSize(this.#place, ({ width, height }) => this.#fit(Math.min(width, height)), this.#end.signal);
    // Paper has another size, and no observer reports it.
    onTheme(() => this.#fit(Math.round(this.#place.clientWidth * devicePixelRatio)), this.#end.signal);
  }

  get world() {
    return this.#drawn.world;
  }

  /**
   * Show what there is in the world now.
   *
   * @param {WorldDrawing} drawn
   */
  show(drawn) {
    this.#drawn = drawn;
    this.#paint();
  }

  /** Take it from the page. */
  remove() {
    this.#end.abort();
    this.element.remove();
  }

  /**
   * @param {Viewpoint} viewpoint
   * @returns {HTMLButtonElement}
   */
  #button(viewpoint) {
    const { name, title } = viewpoint;
    const click = () => this.#look(viewpoint);
    return build("button", { type: "button", tabindex: -1, "aria-pressed": "false", data: { viewpoint: name }, on: { click } }, title);
  }

  /** @param {Viewpoint} viewpoint */
  #look({ name, azimuth_deg: azimuth, elevation_deg: elevation }) {
    this.#turn(azimuth, elevation);
    this.#buttons.get(name)?.setAttribute("aria-pressed", "true");
  }

  #lookOn() {
    const { viewpoints } = this.world;
    const at = viewpoints.findIndex(({ name }) => this.#buttons.get(name)?.getAttribute("aria-pressed") === "true");
    this.#look(viewpoints[(at + 1) % viewpoints.length]);
  }

  /**
   * @param {number} azimuth
   * @param {number} elevation
   */
  #turn(azimuth, elevation) {
    this.#azimuth = ((azimuth + 540) % 360) - 180;
    this.#elevation = Math.min(Math.max(elevation, -90), 90);
    for (const button of this.#buttons.values()) button.setAttribute("aria-pressed", "false");
    this.#say();
    this.#soon();
  }

  /** What is dragged follows the pointer: the viewer goes the other way. */
  #turnByHand() {
    const canvas = this.#canvas;
    /** @type {{x: number, y: number}|null} */
    let held = null;
    canvas.addEventListener("pointerdown", ({ pointerId, clientX: x, clientY: y }) => {
      canvas.setPointerCapture(pointerId);
      held = { x, y };
    });
    canvas.addEventListener("pointermove", ({ clientX: x, clientY: y }) => {
      if (held === null) return;
      this.#turn(this.#azimuth - DEGREES_PER_PX * (x - held.x), this.#elevation + DEGREES_PER_PX * (y - held.y));
      held = { x, y };
    });
    for (const type of /** @type {const} */ (["pointerup", "pointercancel"])) canvas.addEventListener(type, () => (held = null));
    canvas.addEventListener("keydown", (event) => {
      const way = TURNS[event.key];
      if ((way === undefined && event.key !== "Enter") || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault(); // Without the focus here they move through the run.
      if (way === undefined) this.#lookOn();
      else this.#turn(this.#azimuth + DEGREES_PER_KEY * way[0], this.#elevation + DEGREES_PER_KEY * way[1]);
    });
  }

  #resize() {
    const large = this.element.toggleAttribute("data-large");
    this.#size.setAttribute("aria-pressed", String(large));
  }

  /** @param {number} side */
  #fit(side) {
    this.#side = side;
    // At once: until the next frame of the display the canvas would be shown at its old size.
    this.#paint();
  }

  #paint() {
    const context = this.#canvas.getContext("2d", { alpha: false });
    const pixels = this.#side;
    if (context === null || pixels === 0) return;
    if (this.#canvas.width !== pixels) this.#canvas.width = this.#canvas.height = pixels;
    paintWorld(context, this.#drawn, this.#azimuth, this.#elevation, (layer) => this.#layers.isShown(layer), devicePixelRatio * enlargement(this.#place));
  }

  #say() {
    const from = `${Math.round(this.#azimuth)} degrees to the right, ${Math.round(this.#elevation)} above`;
    const keys = "arrow keys turn it, and Enter shows the next side";
    this.#canvas.setAttribute("aria-label", `${this.world.title}, in ${this.world.unit}, seen from ${from}; ${keys}`);
    this.#canvas.dataset.azimuth = String(Math.round(this.#azimuth));
    this.#canvas.dataset.elevation = String(Math.round(this.#elevation));
  }
}

/**
 * Paint a world on a square canvas.
 *
 * @param {CanvasRenderingContext2D} context
 * @param {WorldDrawing} drawn
 * @param {number} azimuth
 * @param {number} elevation
 * @param {(layer: string) => boolean} isShown
 * @param {number} [density] Pixels of the canvas per px of the drawing.
 */
export function paintWorld(context, { world, primitives }, azimuth, elevation, isShown, density = devicePixelRatio) {
  const { width, height } = context.canvas;
  const side = width / density;
  const view = projection(world, azimuth, elevation, side);
  const surface = { context, width, height, scale: density, density, picture: () => undefined };
  paint(surface, { primitives: [...projected(view, primitives), ...ruler(world, view, side)] }, isShown);
}
