/** The picture of the run, flat or in three dimensions, and notices over it when there is nothing to show: loading, crashed, suspended,
 gone. */

import { request } from "../shared/api.js";
import { attempt, build, fill, Notice, renderIn, Segments } from "../shared/dom.js";
import { until } from "../shared/timing.js";
import { remember, remembered } from "../shared/visitor.js";
import { h, html, signal as live } from "../vendor/preact.js";
import { Layers } from "./flat/drawing.js";
import { FlatView } from "./flat/flat_view.js";
import { SpatialScene } from "./spatial_scene.js";

/** @import { Action } from "../shared/dom.js" */
/** @import { SessionPublic } from "../shared/messages.js" */
/** @import { Child } from "../vendor/preact.js" */
/** @import { Overlay } from "./flat/drawing.js" */
/** @import { Mounted } from "./mount.js" */

// The view that a page shows: that of its address, or else a person's last choice, or else what the browser can draw fast. A 3-D scene
// drawn by the processor is slow, and without WebGL there is none.

/** @typedef {"flat"|"scene"} ViewKind */

const NAME = "view";
const KEY = "pftrack-view";
/** Browsers' names of WebGL without a graphics card. */
const SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i;

/** @returns {ViewKind} */
function chosenView() {
  const named = [new URLSearchParams(location.search).get(NAME), remembered(KEY)].find(isView);
  return named ?? (graphics() === "fast" ? "scene" : "flat");
}

/**
 * @param {string|null} name
 * @returns {name is ViewKind}
 */
function isView(name) {
  return name === "flat" || name === "scene";
}

/** Store a person's choice, also in the address if it names another view.
 *
 * @param {ViewKind} kind
 */
function rememberView(kind) {
  remember(KEY, kind);
  const address = new URL(location.href);
  if (!address.searchParams.has(NAME)) return;
  address.searchParams.set(NAME, kind);
  history.replaceState(null, "", address);
}

/** The browser's capability for 3-D scenes.
 *
 * @returns {"none"|"slow"|"fast"}
 */
export function graphics() {
  try {
    const context = document.createElement("canvas").getContext("webgl2");
    if (context === null) return "none";
    const names = context.getExtension("WEBGL_debug_renderer_info");
    const renderer = String(context.getParameter(names?.UNMASKED_RENDERER_WEBGL ?? context.RENDERER));
    context.getExtension("WEBGL_lose_context")?.loseContext();
    return SOFTWARE.test(renderer) ? "slow" : "fast";
  } catch {
    return "none";
  }
}

/** The views of a run for the switch. */
export const VIEWS = [
  { value: "flat", words: "Flat", hint: "The picture from the front" },
  { value: "scene", words: "3-D", hint: "The scene in three dimensions" },
];
export const NO_GRAPHICS = "This browser has no 3-D graphics (WebGL 2). Turn on hardware acceleration, or use another browser, to see the scene.";
const SKELETON = html`<div class="skeleton-scene" role="img" aria-label="Loading the scene"><div class="shimmer"></div></div>`;

export class Scene {
  /** Element of the scene. */
  root;
  #options;
  #signal;
  #hasSwitch;
  #over = build("div", { class: "made" });
  /** @type {FlatView|SpatialScene|null} */
  #view = null;
  #endView = new AbortController();
  #id = "";
  /** @type {Promise<SessionPublic>} */
  #session = new Promise(() => {});
  #kind = live(/** @type {ViewKind|null} */ (null));
  #mounted = live(/** @type {Mounted|null} */ (null));
  #layers = live(/** @type {Layers|null} */ (null));
  #shows = live(false);
  #hasNoGraphics = live(false);
  #failure = live(/** @type {{title: string, message: string, action: Action|null}|null} */ (null));
  /** Called when the view changes. */
  onView = () => {};

  /**
   * @param {HTMLElement} root
   * @param {AbortSignal} signal Aborted when the scene is removed from the page.
   * @param {{view?: ViewKind, hasLegend?: boolean, layers?: readonly string[], overlay?: Overlay, isBare?: boolean}} [options] The view to
   *     show, without it the page's choice, which a switch changes; whether a flat view says what its colours mean; the layers that
   *     it shows from the beginning, beside those declared so; what says how it is painted where several lie over each other; and
   *     whether the 3-D scene's own panel stays away.
   */
  constructor(root, signal, options = {}) {
    this.root = root;
    this.#options = { ...options };
    this.#signal = signal;
    this.#hasSwitch = options.view === undefined;
    fill(root, this.#over);
    renderIn(this.#over, h(() => [this.#cover(), this.#switch()], {}), signal);
    signal.addEventListener("abort", () => this.#endView.abort());
  }

  /** Resolves when a picture of the run is visible, or when none will come before the scene. */
  get seen() {
    return until(() => this.#shows.value || this.#failure.value !== null, this.#signal);
  }

  /** The window of the scene's frame, if it has one. */
  get window() {
    return this.#view instanceof SpatialScene ? this.#view.window : null;
  }

  /** The flat view, if it is shown. */
  get flat() {
    return this.#view instanceof FlatView ? this.#view : null;
  }

  /** The flat view's layers, if it is shown; components that read it follow it as a signal. */
  get layers() {
    return this.#layers.value;
  }

  /** Resolves when the 3-D scene, which reports its frame, shows a frame.
   *
   * @param {number} [frame] By default the last requested one.
   */
  async comesTo(frame) {
    if (this.#view instanceof SpatialScene) await this.#view.comesTo(frame);
  }

  /**
   * Show a session.
   *
   * @param {string} id
   * @param {Promise<SessionPublic>} session The session's data, once known.
   * @param {boolean} isFresh Whether it is paused at its beginning.
   */
  open(id, session, isFresh) {
    this.#id = id;
    this.#session = session;
    this.#put(this.#options.view ?? chosenView(), isFresh);
  }

  /** Follow the state of the session.
   *
   * @param {Mounted} mounted
   */
  follow(mounted) {
    this.#mounted.value = mounted;
    if (this.#view instanceof SpatialScene) this.#view.follow(mounted);
  }

  /** Show a notice with the reason why there is nothing to show, and the one action, if there is one.
   *
   * @param {string} title
   * @param {string} message
   * @param {Action|null} action
   */
  fail(title, message, action) {
    this.#remove();
    this.#failure.value = { title, message, action };
  }

  /** Show the run in another view.
   *
   * @param {ViewKind} kind
   */
  show(kind) {
    this.#options.view = kind;
    if (kind !== this.#kind.peek() && this.#id !== "") this.#put(kind);
  }

  /**
   * @param {ViewKind} kind
   * @param {boolean} [isFresh]
   */
  #put(kind, isFresh = false) {
    this.#remove();
    this.#endView = new AbortController();
    const { signal } = this.#endView;
    const onSeen = () => (this.#shows.value = true);
    const { isBare } = this.#options;
    this.#view = kind === "flat" ? this.#flatView(onSeen, signal) : new SpatialScene(this.#id, { isFresh, isBare, onSeen }, signal);
    this.root.prepend(this.#view.element);
    this.#kind.value = kind;
    const mounted = this.#mounted.peek();
    if (mounted) this.follow(mounted);
    this.onView();
  }

  /** @param {() => void} onPainted @param {AbortSignal} signal */
  #flatView(onPainted, signal) {
    const { layers: named = [], overlay, hasLegend } = this.#options;
    const layers = this.#session.then(({ layers: declared }) => {
      const known = new Layers(declared.map((layer) => ({ ...layer, shown: layer.shown || named.includes(layer.name) })));
      if (!signal.aborted) this.#layers.value = known;
      return known;
    });
    return new FlatView({ layers, overlay, hasLegend, onPainted }, signal);
  }

  #remove() {
    this.#endView.abort();
    this.#view?.element.remove();
    this.#view = null;
    this.#layers.value = null;
  }

  /** @returns {Child} The notice over the picture. */
  #cover() {
    if (this.#failure.value !== null) return html`<div class="cover">${h(Notice, { ...this.#failure.value, inline: false })}</div>`;
    const { store } = this.#mounted.value ?? {};
    const phase = store?.session?.state ?? "starting";
    if (phase === "crashed" || phase === "suspended") {
      const [title, why] =
        phase === "crashed"
          ? ["The tracker stopped", "Its process ended unexpectedly. Nothing up to this frame is lost."]
          : ["This session is suspended", "Session paused after inactivity. It resumes at the same frame."];
      const action = store?.isReadOnly ? null : { label: "Resume", run: () => attempt(() => request("POST sessions/{session}/resume", { session: this.#id })) };
      return html`<div class="cover">${h(Notice, { title, message: store?.session?.message ?? why, action, inline: false })}</div>`;
    }
    const isWaiting = !this.#shows.value || store?.session?.state === "starting";
    return isWaiting && html`<div class="cover late">${SKELETON}</div>`;
  }

  /** @returns {Child} The switch of views. */
  #switch() {
    const shown = this.#kind.value;
    if (!this.#hasSwitch || shown === null || this.#failure.value !== null) return null;
    const options = this.#hasNoGraphics.value ? [VIEWS[0], { ...VIEWS[1], hint: NO_GRAPHICS, isOff: true }] : VIEWS;
    const choose = (/** @type {string} */ kind) => isView(kind) && this.#choose(kind);
    return html`<div class="view-switch">${h(Segments, { label: "View", options, value: shown, choose })}</div>`;
  }

  /** @param {ViewKind} kind */
  #choose(kind) {
    if (kind === this.#kind.peek()) return;
    this.#hasNoGraphics.value = kind === "scene" && graphics() === "none";
    if (this.#hasNoGraphics.value) return;
    rememberView(kind);
    this.#put(kind);
  }
}
