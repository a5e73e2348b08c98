/** The frame that holds the 3-D scene, and the library's own picture in its place while it is still loading. */

import { addressOf } from "../shared/api.js";
import { build, fill } from "../shared/dom.js";
import { beforePrinting } from "../shared/presentation.js";
import { isDark, onTheme } from "../shared/theme.js";
import { after, follow, later, throttle } from "../shared/timing.js";

/** How long the scene's script, which keeps the browser busy, waits for the still picture. */
const PREVIEW_FIRST_MS = 400;
/** How often to look which frame the scene shows, and how long to wait for a frame that may never come. */
const LOOK_EVERY_MS = 8;
const PATIENCE_MS = 5000;
/** The same for the first picture of the scene. */
const READY_EVERY_MS = 40;
const READY_PATIENCE_MS = 3000;
/** How often the still picture is renewed while the run plays, and how long after it pauses. */
const EVERY_MS = 200;
const SETTLED_MS = 250;

export class SpatialScene {
  #id;
  #on;
  #signal;
  /** @type {HTMLIFrameElement|null} */
  #frame = null;
  /** @type {Preview|null} */
  #preview = null;
  /** The frames that are waited for, in their order.
   *
   * @type {{frame: number, since: number, resolve: () => void}[]} */
  #waiting = [];
  #told = 0;

  element = build("div", { class: "spatial-scene" });
  #opener = build(
    "button",
    { type: "button", class: "panel-opener", "aria-pressed": "false", title: "Layers and views of the scene", on: { click: () => this.#unfold() } },
    "Scene panel",
  );
  /** What is printed in place of the frame, whose graphics are not there for paper. */
  #paper = build("img", { class: "scene-paper", alt: "The current frame with what the tracker believes" });

  /**
   * @param {string} id The session.
   * @param {boolean} isFresh Whether it stands still at its beginning.
   * @param {import("./scene.js").Progress} on
   * @param {AbortSignal} signal
   * @param {boolean} isBare Whether its own panel stays away; otherwise a button shows it.
   */
  constructor(id, isFresh, on, signal, isBare) {
    this.#id = id;
    this.#on = on;
    this.#signal = signal;
    if (!isBare) this.element.append(this.#opener);
    signal.addEventListener("abort", () => this.#release(this.#waiting.length));
    globalThis.addEventListener("message", (event) => this.#press(event), { signal });
    onTheme(() => this.window?.postMessage({ source: "pftrack", theme: theme() }, location.origin), signal);
    beforePrinting(() => this.#print(), signal);
    this.#load(isFresh);
  }

  get window() {
    return this.#frame?.contentWindow ?? null;
  }

  /** Show the scene's own panel, or put it away. */
  #unfold() {
    this.#opener.setAttribute("aria-pressed", String(this.#opener.getAttribute("aria-pressed") !== "true"));
    this.#showPanel();
  }

  /** As the button says; a scene that is loaded again begins without. */
  #showPanel() {
    if (this.window) this.window.document.documentElement.dataset.panel = this.#opener.getAttribute("aria-pressed") === "true" ? "" : "none";
  }

  /**
   * Follow what becomes of the session.
   *
   * @param {import("./mount.js").Mounted} view
   */
  follow({ store }) {
    let down = false;
    let alive = true;
    const hear = () => {
      if (store.connection === "lost") down = true;
      if (store.session === null || store.connection !== "open") return;
      // A frame without focus does not look for its server again, and a revived worker has a new one: load it again.
      if (store.isAwake && (down || !alive)) this.#load();
      alive = store.isAwake;
      if (this.#preview) this.#preview.stopped = !alive;
      if (alive) down = false;
    };
    follow(() => [store.connection, store.isAwake], hear, this.#signal);
    const shown = () => store.session && [store.session.position, store.session.playing, store.session.branch];
    follow(shown, () => store.session && this.#preview?.refresh(store.session.playing), this.#signal);
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
    this.#paper.src = `${addressOf("GET sessions/{session}/frame.png", { session: this.#id })}?at=${Date.now()}`;
    this.element.append(this.#paper);
    await this.#paper.decode();
  }

  async #load(isFresh = false) {
    const preview = new Preview(this.#id, isFresh, this.#signal);
    const isNewest = () => this.#preview === preview && !this.#signal.aborted;
    this.#preview?.element.remove();
    this.#preview = preview;
    this.element.append(preview.element);
    await Promise.race([preview.first, after(PREVIEW_FIRST_MS, this.#signal)]);
    if (!isNewest()) return;
    this.#on.seen();
    const src = `viz/${encodeURIComponent(this.#id)}/?theme=${theme()}&panel=none`;
    const frame = build("iframe", { src, title: "Scene", class: "scene-frame", allow: "fullscreen" });
    frame.addEventListener("load", () => this.#showPanel());
    if (this.#frame) this.#frame.replaceWith(frame);
    else this.element.prepend(frame);
    this.#frame = frame;
    if (await viewerReady(frame, isNewest, this.#signal)) {
      this.#preview.element.remove();
      this.#preview = null;
    }
  }
}

function theme() {
  return isDark() ? "dark" : "light";
}

/**
 * The library's own picture of the current frame, in the scene's place while the scene is still loading: the run is seen
 * at once, and lives.
 */
class Preview {
  #id;
  #signal;
  #often;
  #resolveFirst = () => {};
  #asked = 0;
  #busy = false;

  /** Whether to leave it at the picture there is, because nobody would answer. */
  stopped = false;

  /** What is put into the page. */
  element = build("div", { class: "scene-still" });

  /** Resolves when the first picture is there. */
  first = /** @type {Promise<void>} */ (new Promise((resolve) => {
    this.#resolveFirst = resolve;
  }));

  /**
   * @param {string} id The session.
   * @param {boolean} isFresh Whether it stands still at its beginning, so that its picture can be asked for at once.
   * @param {AbortSignal} signal
   */
  constructor(id, isFresh, signal) {
    this.#id = id;
    this.#signal = signal;
    this.#often = throttle(() => this.#again(), EVERY_MS, signal);
    if (isFresh) this.#ask();
  }

  /**
   * Show the frame that is the current one now. While the run plays that is done at a modest rate; otherwise only once
   * it stands, because asking for a picture would end a seek that is under way.
   *
   * @param {boolean} isPlaying
   */
  refresh(isPlaying) {
    this.#unsettle();
    if (isPlaying) this.#often();
    else this.#unsettle = later(() => this.#again(), SETTLED_MS, this.#signal);
  }

  #unsettle = () => {};

  #again() {
    if (this.element.isConnected && !this.#busy && !this.stopped) this.#ask();
  }

  async #ask() {
    this.#busy = true;
    this.#asked += 1;
    const image = build("img", {
      src: `${addressOf("GET sessions/{session}/frame.png", { session: this.#id })}?picture=${this.#asked}`,
      alt: "The current frame with what the tracker believes",
      fetchpriority: "high",
    });
    try {
      // The old picture stays until the new one can be painted: nothing flashes.
      await image.decode();
      fill(this.element, image);
      this.#resolveFirst();
    } catch {
      // The next one, or the scene.
    } finally {
      this.#busy = false;
    }
  }
}

/**
 * Resolves when the scene in a frame has been drawn, with its camera in place and nothing fading.
 *
 * @param {HTMLIFrameElement} frame
 * @param {() => boolean} isWanted Looking goes on as long as this holds.
 * @param {AbortSignal} signal Ends the looking, without an answer.
 * @returns {Promise<boolean>} False when it is not wanted any more.
 */
async function viewerReady(frame, isWanted, signal) {
  /** @type {number|null} */
  let since = null;
  while (isWanted()) {
    const found = frame.contentWindow?.pftrackScene?.drawn() ?? null;
    if (found !== null) since ??= performance.now();
    // The camera is put in place by a message of its own; it is not when somebody has already turned it.
    if (found === "in place" || (since !== null && performance.now() - since > READY_PATIENCE_MS)) {
      return isWanted();
    }
    await after(READY_EVERY_MS, signal);
  }
  return false;
}
