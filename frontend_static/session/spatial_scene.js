/** The frame that holds the 3-D scene, and the library's own picture in its place while it is still loading. */

import { api } from "../shared/api.js";
import { h } from "../shared/dom.js";
import { beforePrinting } from "../shared/print.js";
import { isDark, onTheme } from "../shared/theme.js";
import { after, later } from "../shared/timing.js";
import { Preview } from "./preview.js";
import { viewerReady } from "./viewer_ready.js";

/** How long the scene's script, which keeps the browser busy, waits for the picture that shall be seen before it. */
const PREVIEW_FIRST_MS = 400;
/** How often to look which frame the scene shows, and how long to wait for one that it may never show. */
const LOOK_EVERY_MS = 8;
const PATIENCE_MS = 5000;

export class SpatialScene {
  #id;
  #on;
  #signal;
  #isBare;
  /** @type {HTMLIFrameElement|null} */
  #frame = null;
  /** @type {Preview|null} */
  #preview = null;
  /** The frames that are waited for, in their order.
   *
   * @type {{frame: number, since: number, resolve: () => void}[]} */
  #waiting = [];
  #told = 0;

  element = h("div", { class: "spatial-scene" });
  /** What is printed in place of the frame, whose graphics are not there for paper. */
  #paper = h("img", { class: "scene-paper", alt: "The current frame with what the tracker believes" });

  /**
   * @param {string} id The session.
   * @param {boolean} isFresh Whether it stands still at its beginning.
   * @param {import("./scene.js").Progress} on
   * @param {AbortSignal} signal
   * @param {boolean} isBare Whether it has no panel of parameters.
   */
  constructor(id, isFresh, on, signal, isBare) {
    this.#id = id;
    this.#on = on;
    this.#signal = signal;
    this.#isBare = isBare;
    this.element.classList.toggle("bare", isBare);
    signal.addEventListener("abort", () => this.#release(this.#waiting.length));
    globalThis.addEventListener("message", (event) => this.#press(event), { signal });
    onTheme(() => this.window?.postMessage({ source: "pftrack", theme: theme() }, location.origin), signal);
    beforePrinting(() => this.#print(), signal);
    this.#load(isFresh);
  }

  get window() {
    return this.#frame?.contentWindow ?? null;
  }

  /**
   * Follow what becomes of the session.
   *
   * @param {import("./mount.js").Mounted} view
   */
  follow({ store }) {
    let down = false;
    let alive = true;
    store.on(["state", "connection"], () => {
      if (store.connection === "lost") down = true;
      if (this.#signal.aborted || store.session === null || store.connection !== "open") return;
      // A frame without focus does not look for its server again, and a revived worker has a new one: load it again.
      if (store.isAwake && (down || !alive)) this.#load();
      alive = store.isAwake;
      if (this.#preview) this.#preview.stopped = !alive;
      if (alive) down = false;
    });
    store.on(["position", "playing", "branch"], () => this.#preview?.refresh(store.session?.playing ?? false));
  }

  /**
   * Resolve when the scene shows this frame or a later request; at once while no scene is loaded.
   *
   * @param {number} [frame] The one asked for last if not given.
   * @returns {Promise<void>}
   */
  comesTo(frame = this.#told) {
    this.#told = frame;
    if (this.#preview !== null || this.#signal.aborted) return Promise.resolve();
    return new Promise((resolve) => {
      this.#waiting.push({ frame, since: performance.now(), resolve });
      if (this.#waiting.length === 1) this.#look();
    });
  }

  #look() {
    const shown = this.window?.pftrackScene?.frame();
    const late = performance.now() - PATIENCE_MS;
    const last = this.#waiting.findLastIndex(({ frame, since }) => frame === shown || since < late);
    this.#release(last + 1);
    if (this.#waiting.length > 0) later(() => this.#look(), LOOK_EVERY_MS, this.#signal);
  }

  /** @param {number} count How many need not wait any more. */
  #release(count) {
    for (const { resolve } of this.#waiting.splice(0, count)) resolve();
  }

  /**
   * The frame has handed on a key: for the page it is pressed on the frame, so whatever listens to keys takes it.
   *
   * @param {MessageEvent} event
   */
  #press({ origin, source, data }) {
    if (origin !== location.origin || source === null || source !== this.window) return;
    if (data?.source !== "pftrack-viser" || typeof data.key !== "string") return;
    const { key, shiftKey } = data;
    this.#frame?.dispatchEvent(new KeyboardEvent("keydown", { key, shiftKey: shiftKey === true, bubbles: true, cancelable: true }));
  }

  async #print() {
    this.#paper.src = `${api.frameAddress(this.#id)}?at=${Date.now()}`;
    this.element.append(this.#paper);
    await this.#paper.decode();
  }

  async #load(isFresh = false) {
    const preview = new Preview(this.#id, isFresh, this.#signal);
    const isNewest = () => this.#preview === preview && !this.#signal.aborted;
    this.#preview?.element.remove();
    this.#preview = preview;
    this.element.append(preview.element);
    const first = preview.first.then(() => isNewest() && this.#on.seen());
    await Promise.race([first, after(PREVIEW_FIRST_MS, this.#signal)]);
    if (!isNewest()) return;
    this.#on.seen();
    const src = `viz/${encodeURIComponent(this.#id)}/?theme=${theme()}${this.#isBare ? "&panel=none" : ""}`;
    const frame = h("iframe", { src, title: "Scene", class: "scene-frame", allow: "fullscreen" });
    // What has to wait for the scene's script must not come before the picture either.
    frame.addEventListener("load", () => preview.first.then(() => isNewest() && this.#on.loaded()));
    if (this.#frame) this.#frame.replaceWith(frame);
    else this.element.prepend(frame);
    this.#frame = frame;
    if (await viewerReady(frame, isNewest, this.#signal)) {
      this.#preview.element.remove();
      this.#preview = null;
      this.#on.drawn();
    }
  }
}

function theme() {
  return isDark() ? "dark" : "light";
}
