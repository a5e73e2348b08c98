/** The iframe of the 3-D scene, and the library's own picture in its place while it is loading. */

import { addressOf } from "../shared/api.js";
import { build, fill } from "../shared/dom.js";
import { beforePrinting } from "../shared/presentation.js";
import { isDark, onTheme } from "../shared/theme.js";
import { after, follow, later } from "../shared/timing.js";

/** How long the scene's script, which keeps the browser busy, waits for the still picture. */
const STILL_FIRST_MS = 400;
/** How often to check the scene's frame, and how long to wait for a frame that may never come. */
const LOOK_EVERY_MS = 8;
const PATIENCE_MS = 5000;
/** These times for the first picture of the scene. */
const READY_EVERY_MS = 40;
const READY_PATIENCE_MS = 3000;
/** How often the still picture is renewed while the run plays, and the delay after a pause. */
const EVERY_MS = 200;
const SETTLED_MS = 250;

export class SpatialScene {
  #id;
  #onSeen;
  #signal;
  /** @type {HTMLIFrameElement|null} */
  #frame = null;
  /** Aborted when the scene is loaded, or loads again; null while it is loaded.
   *
   * @type {AbortController|null} */
  #loading = null;
  /** The awaited frames in order, and the last requested one.
   *
   * @type {{frame: number, since: number, resolve: () => void}[]} */
  #waiting = [];
  #told = 0;
  /** The scene's frame, and the time since which it is shown. */
  #seen = { frame: /** @type {number|null|undefined} */ (null), since: 0 };

  element = build("div", { class: "spatial-scene" });
  /** The library's own picture of the current frame, so that the run is visible at once. */
  #still = build("div", { class: "scene-still" });
  /** Time of the last request for it, and whether its answer is pending. */
  #stillAt = 0;
  #isAsking = false;
  #onStill = () => {};
  #unsettle = () => {};
  #opener = build(
    "button",
    { type: "button", class: "panel-opener", "aria-pressed": "false", title: "Layers and views of the scene", on: { click: () => this.#unfold() } },
    "Scene panel",
  );

  /**
   * @param {string} id The session.
   * @param {{isFresh: boolean, isBare?: boolean, onSeen: () => void}} options Whether it stands still at its beginning, so that its
   *     picture can be asked for at once; whether its own panel stays away, otherwise a button shows it; and what is called when
   *     there is a picture of the run to see, or will be none before the scene.
   * @param {AbortSignal} signal
   */
  constructor(id, { isFresh, isBare = false, onSeen }, signal) {
    this.#id = id;
    this.#onSeen = onSeen;
    this.#signal = signal;
    if (!isBare) this.element.append(this.#opener);
    signal.addEventListener("abort", () => this.#release(this.#waiting.length));
    globalThis.addEventListener("message", (event) => this.#press(event), { signal });
    onTheme(() => this.window?.postMessage({ source: "pftrack", theme: theme() }, location.origin), signal);
    beforePrinting(() => this.#print(), signal);
    this.#load();
    if (isFresh) this.#ask();
  }

  get window() {
    return this.#frame?.contentWindow ?? null;
  }

  /** Show or hide the scene's own panel. */
  #unfold() {
    this.#opener.setAttribute("aria-pressed", String(this.#opener.getAttribute("aria-pressed") !== "true"));
    this.#showPanel();
  }

  /** Apply the button's state; a scene that is loaded again begins without its panel. */
  #showPanel() {
    if (this.window) this.window.document.documentElement.dataset.panel = this.#opener.getAttribute("aria-pressed") === "true" ? "" : "none";
  }

  /** Follow the state of the session.
   *
   * @param {import("./mount.js").Mounted} view
   */
  follow({ store }) {
    let isStale = false;
    const hear = () => {
      const isOpen = store.session !== null && store.connection.value === "open";
      if (store.connection.value === "lost" || (isOpen && !store.isAwake)) isStale = true;
      // An iframe without focus does not reconnect, and a restarted worker has a new scene: load it again.
      if (!isStale || !isOpen || !store.isAwake) return;
      isStale = false;
      this.#load();
    };
    follow(() => [store.connection.value, store.isAwake], hear, this.#signal);
    const renew = () => {
      this.#unsettle();
      if (this.#loading === null || !store.session) return;
      // A paused run is asked only after a while, because the request would end a seek.
      const wait = store.session.playing ? this.#stillAt + EVERY_MS - performance.now() : SETTLED_MS;
      this.#unsettle = later(() => store.isAwake && !this.#isAsking && this.#ask(), wait, this.#loading.signal);
    };
    follow(() => store.session && [store.session.position, store.session.playing, store.session.branch], renew, this.#signal);
  }

  /**
   * Resolve when the scene shows this frame or that of a later request; at once while no scene is loaded.
   *
   * @param {number} [frame] By default the last requested one.
   * @returns {Promise<void>}
   */
  comesTo(frame = this.#told) {
    this.#told = frame;
    if (this.#loading !== null || this.#signal.aborted) return Promise.resolve();
    return new Promise((resolve) => {
      this.#waiting.push({ frame, since: performance.now(), resolve });
      if (this.#waiting.length === 1) this.#look();
    });
  }

  /** Release all finished waits at once: one after the other, the page would show old values. */
  #look() {
    const shown = this.window?.pftrackScene?.frame();
    if (shown !== this.#seen.frame) this.#seen = { frame: shown, since: performance.now() };
    const late = performance.now() - PATIENCE_MS;
    // Wait for a slow scene, but not for a stopped one.
    const last = this.#waiting.findLastIndex(({ frame, since }) => frame === shown || Math.max(since, this.#seen.since) < late);
    this.#release(last + 1);
    if (this.#waiting.length > 0) later(() => this.#look(), LOOK_EVERY_MS, this.#signal);
  }

  /** @param {number} count Number of finished waits. */
  #release(count) {
    for (const { resolve } of this.#waiting.splice(0, count)) resolve();
  }

  /** Dispatch a key passed on by the scene as if it were pressed on the iframe, so that all key handlers receive it.
   *
   * @param {MessageEvent} event
   */
  #press({ origin, source, data }) {
    if (origin !== location.origin || source === null || source !== this.window) return;
    if (data?.source !== "pftrack-viser" || typeof data.key !== "string") return;
    const { key, shiftKey } = data;
    this.#frame?.dispatchEvent(new KeyboardEvent("keydown", { key, shiftKey: shiftKey === true, bubbles: true, cancelable: true }));
  }

  /** The iframe's graphics are not available for printing. */
  async #print() {
    const paper = this.#picture("scene-paper");
    this.element.querySelector(".scene-paper")?.remove();
    this.element.append(paper);
    await paper.decode();
  }

  /** @param {string} className */
  #picture(className) {
    const src = `${addressOf("GET sessions/{session}/frame.png", { session: this.#id })}?at=${Date.now()}`;
    return build("img", { class: className, src, alt: "The current frame with what the tracker believes", fetchpriority: "high" });
  }

  /** Renew the still picture. The old one stays until the new one can be painted, so nothing flashes. */
  async #ask() {
    this.#isAsking = true;
    this.#stillAt = performance.now();
    const image = this.#picture("");
    try {
      await image.decode();
      fill(this.#still, image);
      this.#onStill();
    } catch {
      // The next picture, or the scene, will replace it.
    } finally {
      this.#isAsking = false;
    }
  }

  async #load() {
    this.#loading?.abort();
    const loading = (this.#loading = new AbortController());
    const signal = AbortSignal.any([loading.signal, this.#signal]);
    this.element.append(fill(this.#still));
    const first = /** @type {Promise<void>} */ (new Promise((resolve) => {
      this.#onStill = resolve;
    }));
    await Promise.race([first, after(STILL_FIRST_MS, signal)]);
    if (signal.aborted) return;
    this.#onSeen();
    const src = `viz/${encodeURIComponent(this.#id)}/?theme=${theme()}&panel=none`;
    const frame = build("iframe", { src, title: "Scene", class: "scene-frame", allow: "fullscreen", on: { load: () => this.#showPanel() } });
    if (this.#frame) this.#frame.replaceWith(frame);
    else this.element.prepend(frame);
    this.#frame = frame;
    await viewerReady(frame, signal);
    this.#still.remove();
    this.#loading = null;
    loading.abort();
  }
}

function theme() {
  return isDark() ? "dark" : "light";
}

/**
 * Resolves when the scene in a frame has been drawn, with its camera in place and nothing fading.
 *
 * @param {HTMLIFrameElement} frame
 * @param {AbortSignal} signal Ends the waiting without an answer.
 */
async function viewerReady(frame, signal) {
  let late = Infinity;
  while (performance.now() < late) {
    const found = frame.contentWindow?.pftrackScene?.drawn() ?? null;
    // A separate message sets the camera; not if a person has already turned it.
    if (found === "in place") return;
    if (found !== null) late = Math.min(late, performance.now() + READY_PATIENCE_MS);
    await after(READY_EVERY_MS, signal);
  }
}
