/**
 * The flat view of a session: its newest drawing from the front, on a canvas, without WebGL.
 *
 * The canvas is as large as its place allows in the picture's proportions, in pixels of the display. Drawings arrive as fast as they are
 painted; of two that are ready between two frames of the display, the newer one is painted. The worlds of a drawing are next to the picture
 and painted together with it. */

import { build, renderIn, setText } from "../../shared/dom.js";
import { enlargement, watchCanvasSize } from "../../shared/theme.js";
import { coalesce, follow, later } from "../../shared/timing.js";
import { h, html, render } from "../../vendor/preact.js";
import { decode, LayerLegend, Layers } from "./drawing.js";
import { paint } from "./paint.js";
import { WorldView } from "./world_view.js";

/** @import { CanvasSize } from "../../shared/theme.js" */
/** @import { Drawing, Overlay, Primitive } from "./drawing.js" */

/** Largest distance of the pointer, pixels of the page. */
const REACH = 9;

/** The full name at the pointer: that of the nearest named point, whether its label is shown or not.
 *
 * @param {readonly Primitive[]} primitives
 * @param {number} x px of the drawing, from the centre of its first pixel
 * @param {number} y
 * @param {number} scale Pixels of the page per px of the drawing.
 * @returns {string} Empty if there is none.
 */
export function nameAt(primitives, x, y, scale) {
  let [name, nearest] = ["", REACH / scale];
  for (const item of primitives) {
    if (item.kind !== "text" || item.title === "" || item.point === null) continue;
    const distance = Math.hypot(item.point[0] - x, item.point[1] - y);
    if (distance <= nearest) [name, nearest] = [item.title, distance];
  }
  return name;
}

/** @typedef {{key: number, decoded: Promise<ImageBitmap|null>, needed: number}} Kept `needed` is the last drawing that needs it. */

/** The pictures of drawings, decoded outside the page's thread and freed once no drawing needs them. */
export class Pictures {
  /** @type {Set<Kept>} */
  #all = new Set();

  /** Take the files of a drawing, and keep the pictures that it needs.
   *
   * @param {Drawing} drawing
   * @param {number} number Number of the drawing, in order of arrival.
   * @returns {Promise<Map<number, ImageBitmap>>} Its pictures by key; one that cannot be decoded is missing.
   */
  async of(drawing, number) {
    for (const [key, file] of drawing.files) {
      const decoded = createImageBitmap(new Blob([/** @type {BlobPart} */ (file)], { type: "image/jpeg" })).catch(() => null);
      this.#all.add({ key, decoded, needed: number });
    }
    const named = new Set(drawing.primitives.flatMap((item) => (item.kind === "picture" ? [item.image_rgb.key] : [])));
    // A later picture replaces an earlier one with the same key.
    const needed = new Map([...this.#all].filter(({ key }) => named.has(key)).map((kept) => [kept.key, kept]));
    for (const kept of needed.values()) kept.needed = number;
    const found = await Promise.all([...needed].map(async ([key, { decoded }]) => /** @type {const} */ ([key, await decoded])));
    return new Map(found.flatMap(([key, bitmap]) => (bitmap === null ? [] : [[key, bitmap]])));
  }

  /** Free pictures that only earlier drawings needed.
   *
   * @param {number} number
   */
  free(number) {
    for (const kept of this.#all) {
      if (kept.needed >= number) continue;
      this.#all.delete(kept);
      kept.decoded.then((bitmap) => bitmap?.close());
    }
  }
}

/** A playing run shows its next frame sooner than this. */
const QUIET_MS = 400;

/** @typedef {{drawing: Drawing, bitmaps: Map<number, ImageBitmap>, number: number, painted: () => void}} Ready */

/**
 * @typedef {object} Options
 * @property {Promise<Layers>} layers The shown layers, once they are known.
 * @property {Overlay} [overlay] How it is painted among several views that lie over each other; the canvas is then transparent.
 * @property {() => void} [onPainted] Called when a drawing was painted.
 * @property {boolean} [hasLegend] Whether the line below the picture is a legend instead of a caption.
 */

export class FlatView {
  /** Whether it shows a picture. */
  hasPicture = false;

  #canvas = build("canvas", { class: "flat-canvas", role: "img", "aria-label": "The current frame is loading" });
  #caption = build("p", { class: "flat-caption" });
  #place = build("div", { class: "flat-place small-print" }, this.#canvas);
  #beside = build("div", { class: "worlds" });
  #legend = build("div", { class: "made" });
  #pictures = new Pictures();
  #unsettle = () => {};
  #layers = new Layers();
  #known;
  #overlay;
  #onPainted;
  #signal;
  #came = 0;
  /** @type {Ready|null} */
  #ready = null;
  /** Extent of the picture's place.
   *
   * @type {CanvasSize} */
  #room = { width: 0, height: 0 };
  #soon;

  /**
   * @param {Options} options
   * @param {AbortSignal} signal
   */
  constructor({ layers, overlay, onPainted = () => {}, hasLegend = false }, signal) {
    const main = build("div", { class: "flat-main" }, build("div", { class: "flat-body" }, this.#place, this.#beside));
    const line = build("div", { class: "flat-line", "data-legend": hasLegend }, this.#legend, this.#caption);
    this.element = build("div", { class: "flat-scene" }, build("div", { class: "flat-view" }, main, line));
    this.#overlay = overlay;
    this.#onPainted = onPainted;
    this.#signal = signal;
    this.#soon = coalesce(() => this.#paint(), signal);
    this.#known = layers.then((known) => {
      this.#layers = known;
      follow(() => [known.shown.value, overlay?.coat.value], this.#soon, signal);
      if (hasLegend && !signal.aborted) renderIn(this.#legend, h(LayerLegend, { layers: known }), signal);
    });
    // The session shows why the drawing is missing.
    this.#known.catch(() => {});
    watchCanvasSize(this.#place, (room) => this.#resize(room), signal);
    this.#nameWhatIsPointedAt();
    signal.addEventListener("abort", () => {
      this.#pictures.free(Infinity);
      render(null, this.#beside);
    });
  }

  /**
   * Read a drawing and unpack its pictures.
   *
   * @param {ArrayBuffer} data The received message.
   * @param {() => void} painted Called when the drawing was painted or dropped.
   * @returns {Promise<{messages: import("../../shared/messages.js").SessionMessage[], show: () => void}>} The messages up to it, and a
   *     function that paints it with the next frame of the display.
   * @throws {Error} The message is not a drawing that this page can read.
   */
  async prepare(data, painted) {
    // If the shown layers were unknown, the first picture would flash all layers.
    await this.#known;
    this.#came += 1;
    const number = this.#came;
    let drawing;
    try {
      drawing = decode(data);
    } catch (error) {
      setText(this.#caption, error instanceof Error ? error.message : String(error));
      throw error;
    }
    const bitmaps = await this.#pictures.of(drawing, number);
    const show = () => {
      this.#ready = { drawing, bitmaps, number, painted };
      this.#soon();
    };
    return { messages: drawing.messages, show };
  }

  /** @param {CanvasSize} room */
  #resize(room) {
    this.#room = room;
    // At once: until the next frame of the display the canvas would be shown at its old size.
    this.#paint();
  }

  #paint() {
    const ready = this.#ready;
    const context = this.#canvas.getContext("2d", { alpha: this.#overlay !== undefined });
    if (ready === null || context === null) return;
    const { drawing, bitmaps, number, painted } = ready;
    this.#pictures.free(number);
    // A hidden canvas paints nothing, and the server need not wait for it.
    if (!this.#room.width || !this.#room.height) {
      painted();
      return;
    }
    const scale = Math.min(this.#room.width / drawing.width, this.#room.height / drawing.height);
    const width = Math.max(1, Math.round(drawing.width * scale));
    const height = Math.max(1, Math.round(drawing.height * scale));
    this.#fit(width, height);
    /** @param {number} key */
    const picture = (key) => bitmaps.get(key);
    // A new function each time: a component that reads signals is rendered again only if its properties change.
    const isShown = (/** @type {string} */ layer) => this.#layers.isShown(layer);
    const surface = { context, width, height, scale, density: devicePixelRatio * enlargement(this.#place), picture };
    paint(surface, drawing, isShown, this.#overlay?.coat.value);
    render(html`${drawing.worlds.map((drawn) => h(WorldView, { key: drawn.world.name, drawn, isShown }))}`, this.#beside);
    this.#say(drawing);
    if (JSON.stringify(drawing.legend) !== JSON.stringify(this.#layers.keys.peek())) this.#layers.keys.value = drawing.legend;
    painted();
    this.hasPicture = true;
    this.#onPainted();
  }

  /** The browser shows the name on hover; for touch, the line below the picture shows it, too. */
  #nameWhatIsPointedAt() {
    const canvas = this.#canvas;
    const named = (/** @type {PointerEvent} */ { offsetX, offsetY }) => {
      if (this.#ready === null) return "";
      const { drawing } = this.#ready;
      const scale = canvas.offsetWidth / drawing.width;
      return nameAt(drawing.primitives, offsetX / scale - 0.5, offsetY / scale - 0.5, scale);
    };
    canvas.addEventListener("pointermove", (event) => (canvas.title = named(event)));
    canvas.addEventListener("pointerdown", (event) => {
      if (this.#ready !== null) setText(this.#caption, named(event) || wordsOf(this.#ready.drawing, this.#overlay));
    });
  }

  /** @param {Drawing} drawing */
  #say(drawing) {
    const words = wordsOf(drawing, this.#overlay);
    setText(this.#caption, words);
    // Only when paused: a screen reader need not speak every picture of a playing run.
    this.#unsettle();
    this.#unsettle = later(() => this.#canvas.setAttribute("aria-label", `The current frame with what the tracker believes: ${words}`), QUIET_MS, this.#signal);
    this.#canvas.dataset.frame = String(drawing.frame);
    this.#canvas.dataset.width = String(drawing.width);
  }

  /**
   * Give the canvas its size, in the middle of its place and on whole pixels of the display.
   *
   * @param {number} width
   * @param {number} height
   */
  #fit(width, height) {
    const canvas = this.#canvas;
    if (canvas.width !== width) canvas.width = width;
    if (canvas.height !== height) canvas.height = height;
    const inPage = (/** @type {number} */ pixels) => `${pixels / devicePixelRatio}px`;
    canvas.style.width = inPage(width);
    canvas.style.height = inPage(height);
    canvas.style.left = inPage(Math.floor((this.#room.width - width) / 2));
    canvas.style.top = inPage(Math.floor((this.#room.height - height) / 2));
  }
}

/**
 * @param {Drawing} drawing
 * @param {Overlay} [overlay]
 */
function wordsOf({ caption, frame }, overlay) {
  const counted = `frame ${frame - (overlay?.first ?? 0)}`;
  return caption ? caption.replace(`frame ${frame}`, counted) : counted;
}
