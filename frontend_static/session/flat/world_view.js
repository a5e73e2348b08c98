/**
 * A world beside the picture, on a canvas of its own: seen from its viewpoints, and from wherever somebody turns it to, by
 * dragging or by the arrow keys. It can be folded and enlarged; how it is seen is the page's affair alone.
 */

import { h } from "../../shared/dom.js";
import { icon } from "../../shared/icons.js";
import { onTheme } from "../../shared/theme.js";
import { coalesce } from "../../shared/timing.js";
import { paint } from "./paint.js";
import { projected, projection, ruler } from "./projection.js";
import { enlargement, watchCanvasSize } from "../../shared/canvas_size.js";

/** @import { Viewpoint } from "../../shared/messages.js" */
/** @import { WorldDrawing } from "./decode.js" */
/** @import { Layers } from "./layers.js" */

const DEGREES_PER_PX = 0.6;
const DEGREES_PER_KEY = 10;
const HINT = "Drag to turn; arrow keys, too";
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
  #canvas = h("canvas", { class: "world-canvas", role: "img", tabindex: 0, title: HINT });
  #place = h("div", { class: "world-place small-print" }, this.#canvas);
  /** @type {Map<string, HTMLButtonElement>} */
  #buttons;
  #size = h(
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
    this.element = h(
      "details",
      { class: "world", open: true, data: { world: world.name } },
      h("summary", {}, `${world.title}, ${world.unit}`),
      this.#size,
      h("div", { class: "world-sides", role: "group", "aria-label": `Sides of ${world.title}` }, [...this.#buttons.values()]),
      this.#place,
    );
    this.#look(world.viewpoints[0]);
    this.#turnByHand();
    signal.addEventListener("abort", () => this.#end.abort());
    watchCanvasSize(this.#place, ({ width, height }) => this.#fit(Math.min(width, height)), this.#end.signal);
    // Paper has another size, of which nothing else is told.
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
    return h("button", { type: "button", "aria-pressed": "false", data: { viewpoint: name }, on: { click: () => this.#look(viewpoint) } }, title);
  }

  /** @param {Viewpoint} viewpoint */
  #look({ name, azimuth_deg: azimuth, elevation_deg: elevation }) {
    this.#turn(azimuth, elevation);
    this.#buttons.get(name)?.setAttribute("aria-pressed", "true");
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
      if (way === undefined || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault(); // Without the focus here they move through the run.
      this.#turn(this.#azimuth + DEGREES_PER_KEY * way[0], this.#elevation + DEGREES_PER_KEY * way[1]);
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
    this.#canvas.setAttribute("aria-label", `${this.world.title}, in ${this.world.unit}, seen from ${from}; arrow keys turn it`);
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
