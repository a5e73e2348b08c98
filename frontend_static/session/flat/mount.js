/**
 * The flat view of a session: its newest drawing from the front, on a canvas, without WebGL.
 *
 * The canvas is as large as its place allows in the picture's proportions, in pixels of the display. Drawings come as fast
 * as they are painted; of two that are ready between two frames of the display the newer one is painted.
 */

import { fill, h, setText } from "../../shared/dom.js";
import { coalesce } from "../../shared/timing.js";
import { decode } from "./decode.js";
import { Layers } from "./layers.js";
import { paint } from "./paint.js";
import { Pictures } from "./pictures.js";
import { DrawingStream } from "./stream.js";

/** @import { Drawing } from "./decode.js" */

/**
 * @typedef {object} Options
 * @property {string} session Its identifier.
 * @property {Layers} [layers] Which layers are shown; all of them without it.
 * @property {(frame: number) => void} [onPainted] Called with the number of each frame that was painted.
 * @property {() => void} [onGone] Called when the session has ended.
 */

/**
 * Show a session in an element, which gives the view its size.
 *
 * @param {HTMLElement} element
 * @param {Options} options
 * @returns {() => void} Takes the view away with all that belongs to it.
 */
export function mount(element, options) {
  const view = new FlatView(element, options);
  return () => view.dispose();
}

/** @typedef {{drawing: Drawing, bitmaps: Map<number, ImageBitmap>, number: number, painted: () => void}} Ready */

class FlatView {
  #canvas = h("canvas", { class: "flat-canvas", role: "img", "aria-label": "The current frame, not there yet" });
  #caption = h("p", { class: "flat-caption", "aria-hidden": "true" });
  #place = h("div", { class: "flat-place" }, this.#canvas);
  #root = h("div", { class: "flat-view" }, this.#place, this.#caption);
  #pictures = new Pictures();
  #layers;
  #onPainted;
  #stream;
  #sizes;
  #endLayers;
  #came = 0;
  /** @type {Ready|null} */
  #ready = null;
  /** Extent of its place, pixels of the display. */
  #room = { width: 0, height: 0 };
  #isDisposed = false;

  /**
   * @param {HTMLElement} element
   * @param {Options} options
   */
  constructor(element, { session, layers = new Layers(), onPainted = () => {}, onGone = () => {} }) {
    this.#layers = layers;
    this.#onPainted = onPainted;
    fill(element, this.#root);
    this.#sizes = new ResizeObserver(([entry]) => this.#resize(entry));
    this.#observe();
    this.#endLayers = layers.on(this.#soon);
    this.#stream = new DrawingStream(session, (message, painted) => this.#receive(message, painted), onGone);
  }

  dispose() {
    this.#isDisposed = true;
    this.#stream.close();
    this.#sizes.disconnect();
    this.#endLayers();
    this.#pictures.free(Infinity);
    this.#root.remove();
  }

  #observe() {
    try {
      this.#sizes.observe(this.#place, { box: "device-pixel-content-box" });
    } catch {
      this.#sizes.observe(this.#place);
    }
  }

  /** @param {ResizeObserverEntry} entry */
  #resize({ devicePixelContentBoxSize: sizes, contentRect }) {
    const width = sizes?.[0]?.inlineSize ?? Math.round(contentRect.width * devicePixelRatio);
    const height = sizes?.[0]?.blockSize ?? Math.round(contentRect.height * devicePixelRatio);
    this.#room = { width, height };
    // At once: a canvas that waits for the next frame would be shown stretched.
    this.#paint();
  }

  /**
   * @param {ArrayBuffer} message
   * @param {() => void} painted
   */
  async #receive(message, painted) {
    this.#came += 1;
    const number = this.#came;
    const drawing = decode(message);
    const bitmaps = await this.#pictures.of(drawing, number);
    if (this.#isDisposed || number < (this.#ready?.number ?? 0)) return;
    this.#ready = { drawing, bitmaps, number, painted };
    this.#soon();
  }

  #soon = coalesce(() => this.#paint());

  #paint() {
    const ready = this.#ready;
    const context = this.#canvas.getContext("2d", { alpha: false });
    if (this.#isDisposed || ready === null || context === null || !this.#room.width || !this.#room.height) return;
    const { drawing, bitmaps, number, painted } = ready;
    const scale = Math.min(this.#room.width / drawing.width, this.#room.height / drawing.height);
    this.#fit(Math.round(drawing.width * scale), Math.round(drawing.height * scale));
    const { width, height } = this.#canvas;
    const surface = { context, width, height, scale, density: devicePixelRatio, picture: (/** @type {number} */ key) => bitmaps.get(key) };
    paint(surface, drawing, (layer) => this.#layers.isShown(layer));
    const words = drawing.caption || `frame ${drawing.frame}`;
    setText(this.#caption, words);
    this.#canvas.setAttribute("aria-label", `The current frame with what the tracker believes. ${words}`);
    this.#canvas.dataset.frame = String(drawing.frame);
    painted();
    this.#pictures.free(number);
    this.#onPainted(drawing.frame);
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
