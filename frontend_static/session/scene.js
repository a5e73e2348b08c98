/**
 * Where the run itself is seen, flat or in three dimensions, and what lies over it when there is nothing to see: loading,
 * crashed, suspended, gone.
 */

import { request } from "../shared/api.js";
import { attempt, build, fill, Notice } from "../shared/dom.js";
import { later } from "../shared/timing.js";
import { remember, remembered } from "../shared/visitor.js";
import { h, html, render, signal as live } from "../vendor/preact.js";
import { FlatScene } from "./flat/flat_view.js";
import { SpatialScene } from "./spatial_scene.js";

/** @import { Action } from "../shared/dom.js" */
/** @import { SessionPublic } from "../shared/messages.js" */
/** @import { Child } from "../vendor/preact.js" */
/** @import { Layers, Overlay } from "./flat/drawing.js" */
/** @import { Mounted } from "./mount.js" */

// Which view of a session a page shows: what its address says, else what a person chose before, else what the browser can
// draw fast. A 3-D scene that the processor has to draw is slow, and without WebGL there is none.

/** @typedef {"flat"|"scene"} ViewKind */

const NAME = "view";
const KEY = "pftrack-view";
/** What browsers call WebGL without a graphics card. */
const SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i;

/** @returns {ViewKind} */
function chosenView() {
  return viewNamed(new URLSearchParams(location.search).get(NAME)) ?? viewNamed(remembered(KEY)) ?? (graphics() === "fast" ? "scene" : "flat");
}

/**
 * Remember what a person has chosen, in the address, too, if that says something else.
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

/**
 * What the browser offers for 3-D scenes.
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

/**
 * @param {string|null} name
 * @returns {ViewKind|null}
 */
function viewNamed(name) {
  return name === "flat" || name === "scene" ? name : null;
}

/**
 * What a view tells while it comes up.
 *
 * @typedef {object} Progress
 * @property {() => void} seen There is a picture of the run to see, or will be none before the view itself.
 * @property {(layers: Layers) => void} layers What its drawings show.
 */

/** Later than elsewhere: a skeleton just before the picture would only make it flicker. */
const SKELETON_AFTER_MS = 500;
export const NO_GRAPHICS = "This browser has no 3-D graphics (WebGL 2). Turn on hardware acceleration, or use another browser, to see the scene.";
const SKELETON = html`<div class="skeleton-scene" role="img" aria-label="Loading the scene"><div class="shimmer"></div></div>`;

export class Scene {
  /** What holds it. */
  root;
  #fixed;
  #options;
  #cover = build("div", { class: "made" });
  /** @type {FlatScene|SpatialScene|null} */
  #view = null;
  #endView = new AbortController();
  #id = "";
  /** @type {ViewKind|null} */
  #kind = null;
  /** @type {Promise<SessionPublic>} */
  #session = new Promise(() => {});
  #mounted = live(/** @type {Mounted|null} */ (null));
  #layers = live(/** @type {Layers|null} */ (null));
  #shows = live(false);
  #isLate = live(false);
  #failure = live(/** @type {{title: string, message: string, action: Action|null}|null} */ (null));
  #onView = () => {};
  #resolveSeen = () => {};

  /**
   * @param {HTMLElement} root
   * @param {AbortSignal} signal Aborted when the scene is taken from the page.
   * @param {{view?: ViewKind, hasLegend?: boolean, layers?: readonly string[], overlay?: Overlay, isBare?: boolean}} [options] The view to
   *     show, without it the page's choice, which a switch changes; whether a flat view says what its colours mean; the layers that
   *     it shows from the beginning, beside those declared so; what says how it is painted where several lie over each other; and
   *     whether the 3-D scene's own panel stays away.
   */
  constructor(root, signal, { view, ...options } = {}) {
    this.root = root;
    this.#fixed = view;
    this.#options = options;
    fill(root, this.#cover);
    render(h(() => this.#covering(), {}), this.#cover);
    signal.addEventListener("abort", () => {
      this.#endView.abort();
      render(null, this.#cover);
    });
    later(() => (this.#isLate.value = true), SKELETON_AFTER_MS, signal);
  }

  /** Resolves when there is a picture of the run to see, or will be none before the scene. */
  seen = /** @type {Promise<void>} */ (new Promise((resolve) => {
    this.#resolveSeen = resolve;
  }));

  /** The window of the scene's frame, if it has one. */
  get window() {
    return this.#view?.window ?? null;
  }

  /** The flat view, if that is what is shown. */
  get flat() {
    return this.#view instanceof FlatScene ? this.#view : null;
  }

  /** What the flat view's drawings show, if that is what is shown; components that read it follow it. */
  get layers() {
    return this.#layers.value;
  }

  /**
   * Resolves when a scene that says which frame it shows has come to a frame.
   *
   * @param {number} [frame] The one asked for last if not given.
   */
  async comesTo(frame) {
    if (this.#view instanceof SpatialScene) await this.#view.comesTo(frame);
  }

  /**
   * Call something whenever the run is seen in another way than before.
   *
   * @param {() => void} work
   */
  onView(work) {
    this.#onView = work;
  }

  /**
   * Show a session.
   *
   * @param {string} id
   * @param {Promise<SessionPublic>} session What else is known of it, as soon as it is.
   * @param {boolean} isFresh Whether it stands still at its beginning.
   */
  open(id, session, isFresh) {
    this.#id = id;
    this.#session = session;
    const kind = this.#fixed ?? chosenView();
    if (this.#fixed === undefined) this.root.append(viewSwitch(kind, (chosen) => this.#choose(chosen)));
    this.#put(kind, isFresh);
  }

  /**
   * Follow what becomes of the session.
   *
   * @param {Mounted} mounted
   */
  follow(mounted) {
    this.#mounted.value = mounted;
    if (this.#view instanceof SpatialScene) this.#view.follow(mounted);
  }

  /**
   * Say that there is nothing to show, why, and the one way on, if there is one.
   *
   * @param {string} title
   * @param {string} message
   * @param {Action|null} action
   */
  fail(title, message, action) {
    this.#remove();
    this.root.querySelector(".view-switch")?.remove();
    this.#resolveSeen();
    this.#failure.value = { title, message, action };
  }

  /**
   * Show the run in another way.
   *
   * @param {ViewKind} kind
   */
  show(kind) {
    if (kind === this.#kind) return;
    this.#fixed = kind;
    if (this.#id !== "") this.#put(kind, false);
  }

  /**
   * Put something over all of it.
   *
   * @param {HTMLElement} element
   */
  lay(element) {
    this.root.append(element);
  }

  /** @param {ViewKind} kind */
  #choose(kind) {
    rememberView(kind);
    this.#put(kind, false);
  }

  /**
   * @param {ViewKind} kind
   * @param {boolean} isFresh
   */
  #put(kind, isFresh) {
    this.#kind = kind;
    this.#remove();
    this.#endView = new AbortController();
    const { signal } = this.#endView;
    const on = {
      // Nothing has to be said about loading any more.
      seen: () => {
        this.#shows.value = true;
        this.#resolveSeen();
      },
      layers: (/** @type {Layers} */ layers) => (this.#layers.value = layers),
    };
    const { layers = [], isBare = false, ...flat } = this.#options;
    if (kind === "flat") this.#view = new FlatScene(this.#session, on, signal, { layers, ...flat });
    else this.#view = new SpatialScene(this.#id, isFresh, on, signal, isBare);
    this.#cover.before(this.#view.element);
    const mounted = this.#mounted.peek();
    if (mounted) this.follow(mounted);
    this.#onView();
  }

  #remove() {
    this.#endView.abort();
    this.#view?.element.remove();
    this.#view = null;
    this.#layers.value = null;
  }

  /** @returns {Child} What lies over it. */
  #covering() {
    if (this.#failure.value !== null) return html`<div class="cover">${h(Notice, { ...this.#failure.value, inline: false })}</div>`;
    const { store } = this.#mounted.value ?? {};
    const phase = store?.session?.state ?? "starting";
    const isShown = this.#shows.value;
    if (phase === "crashed" || phase === "suspended") {
      const [title, why] =
        phase === "crashed"
          ? ["The tracker stopped", "Its process ended unexpectedly. Nothing up to this frame is lost."]
          : ["This session is suspended", "Session paused after inactivity. It resumes at the same frame."];
      const action = store?.isReadOnly ? null : { label: "Resume", run: () => attempt(() => request("POST sessions/{session}/resume", { session: this.#id })) };
      return html`<div class="cover">${h(Notice, { title, message: store?.session?.message ?? why, action, inline: false })}</div>`;
    }
    const isWaiting = isShown ? store?.session?.state === "starting" : this.#isLate.value;
    return isWaiting && html`<div class="cover">${SKELETON}</div>`;
  }
}

/**
 * @param {ViewKind} kind Which is shown.
 * @param {(kind: ViewKind) => void} choose
 */
function viewSwitch(kind, choose) {
  const buttons = [button("flat", "Flat", "The picture from the front"), button("scene", "3-D", "The scene in three dimensions")];
  /**
   * @param {ViewKind} is
   * @param {string} text
   * @param {string} title
   */
  function button(is, text, title) {
    const press = () => {
      if (element.getAttribute("aria-pressed") === "true") return;
      if (is === "scene" && graphics() === "none") {
        element.disabled = true;
        element.title = NO_GRAPHICS;
        return;
      }
      mark(is);
      choose(is);
    };
    const element = build("button", { type: "button", title, data: { view: is }, on: { click: press } }, text);
    return element;
  }
  // The tab key skips the pressed one, which does nothing.
  const mark = (/** @type {ViewKind} */ is) => {
    for (const each of buttons) {
      each.setAttribute("aria-pressed", String(each.dataset.view === is));
      each.tabIndex = each.dataset.view === is ? -1 : 0;
    }
  };
  mark(kind);
  return build("div", { class: "view-switch", role: "group", "aria-label": "View" }, buttons);
}
