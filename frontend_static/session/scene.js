/**
 * Where the run itself is seen, flat or in three dimensions, and what lies over it when there is nothing to see: loading,
 * crashed, suspended, gone.
 */

import { fill, h } from "../shared/dom.js";
import { notice } from "../shared/notice.js";
import { later } from "../shared/timing.js";
import { FlatScene } from "./flat/flat_scene.js";
import { spokenFrame } from "./spoken_frame.js";
import { watchNote } from "./watch_note.js";
import { seekProgress } from "./seek_progress.js";
import { SpatialScene } from "./spatial_scene.js";
import { chosenView, graphics, rememberView } from "./view_choice.js";

/** @import { SessionPublic } from "../shared/messages.js" */
/** @import { Overlay } from "./flat/overlay.js" */
/** @import { Mounted } from "./mount.js" */
/** @import { ViewKind } from "./view_choice.js" */

/**
 * What a view tells while it comes up.
 *
 * @typedef {object} Progress
 * @property {() => void} seen There is a picture of the run to see, or will be none before the view itself.
 * @property {() => void} loaded The view's own scripts have run; it may still wait for data and for its shaders.
 * @property {() => void} drawn The view itself is drawn.
 */

/** Later than elsewhere: a skeleton just before the picture would only make it flicker. */
const SKELETON_AFTER_MS = 500;
export const NO_GRAPHICS = "This browser has no 3-D graphics (WebGL 2). Turn on hardware acceleration, or use another browser, to see the scene.";

export class Scene {
  /** What holds it. */
  root;
  #fixed;
  #isBare;
  #flat;
  #cover = h("div", { class: "cover", hidden: true });
  /** @type {FlatScene|SpatialScene|null} */
  #view = null;
  #endView = new AbortController();
  #id = "";
  /** @type {ViewKind|null} */
  #kind = null;
  /** @type {Promise<SessionPublic>} */
  #session = new Promise(() => {});
  /** @type {Mounted|null} */
  #mounted = null;
  #shows = false;
  #onView = () => {};
  #resolveSeen = () => {};
  #resolveLoaded = () => {};

  /**
   * @param {HTMLElement} root
   * @param {AbortSignal} signal Aborted when the scene is taken from the page.
   * @param {{view?: ViewKind, hasPanel?: boolean, layers?: readonly string[], overlay?: Overlay, isBare?: boolean}} [options] The view to
   *     show, without it the page's choice, which a switch changes; whether a flat view has a panel of parameters, and
   *     whether the 3-D scene has none; the layers that a flat view shows from the beginning, beside those declared so; and what
   *     says how it is painted where several lie over each other.
   */
  constructor(root, signal, { view, hasPanel = true, layers = [], overlay, isBare = false } = {}) {
    this.root = root;
    this.#fixed = view;
    this.#isBare = isBare;
    this.#flat = { hasPanel, layers, overlay };
    fill(root, this.#cover);
    signal.addEventListener("abort", () => this.#endView.abort());
    later(() => !this.#shows && this.#cover.hidden && this.#show(skeleton()), SKELETON_AFTER_MS, signal);
  }

  /** Resolves when there is a picture of the run to see, or will be none before the scene. */
  seen = /** @type {Promise<void>} */ (new Promise((resolve) => {
    this.#resolveSeen = resolve;
  }));

  /** Resolves when the scene has run its scripts, and only waits for data and shaders, or will never come. */
  loaded = /** @type {Promise<void>} */ (new Promise((resolve) => {
    this.#resolveLoaded = resolve;
  }));

  /** The window of the scene's frame, if it has one. */
  get window() {
    return this.#view?.window ?? null;
  }

  /** The flat view, if that is what is shown. */
  get flat() {
    return this.#view instanceof FlatScene ? this.#view : null;
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
    const { store, commands } = mounted;
    this.#mounted = mounted;
    this.#view?.follow(mounted);
    this.root.append(h("div", { class: "scene-notes" }, seekProgress(mounted)), watchNote(mounted), spokenFrame(mounted));
    store.on(["state", "message", "connection"], () => {
      if (store.session !== null && store.connection === "open") this.#state(store.session, commands);
    });
  }

  /**
   * Say that there is nothing to show, why, and the one way on, if there is one.
   *
   * @param {string} title
   * @param {string} message
   * @param {import("../shared/notice.js").Action|null} action
   */
  fail(title, message, action) {
    this.#remove();
    this.root.querySelector(".view-switch")?.remove();
    this.#seeing();
    this.#resolveLoaded();
    this.#show(notice(title, message, action));
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
    const on = { seen: () => this.#seeing(), loaded: () => this.#resolveLoaded(), drawn: () => this.#drawnNow() };
    const view =
      kind === "flat" ? new FlatScene(this.#session, on, signal, this.#flat) : new SpatialScene(this.#id, isFresh, on, signal, this.#isBare);
    this.#view = view;
    this.#cover.before(view.element);
    if (this.#mounted) view.follow(this.#mounted);
    this.#onView();
  }

  #remove() {
    this.#endView.abort();
    this.#view?.element.remove();
    this.#view = null;
  }

  /**
   * @param {SessionPublic} session
   * @param {import("./commands.js").Commands} commands
   */
  #state(session, commands) {
    const resume = this.#mounted?.store.isReadOnly ? null : { label: "Resume", run: () => commands.resume() };
    if (session.state === "crashed") {
      const message = session.message ?? "Its process ended unexpectedly. Nothing up to this frame is lost.";
      this.#show(notice("The tracker stopped", message, resume));
    } else if (session.state === "suspended") {
      const message = session.message ?? "It was not used for a while. It continues where it was.";
      this.#show(notice("This session is suspended", message, resume));
    } else if (session.state === "starting") {
      if (this.#shows) this.#show(skeleton());
    } else if (this.#shows) {
      this.#cover.hidden = true;
    }
  }

  /** There is something to see now: nothing has to be said about loading any more. */
  #seeing() {
    this.#shows = true;
    if (!this.#cover.querySelector(".notice")) this.#cover.hidden = true;
    this.#resolveSeen();
  }

  #drawnNow() {
    this.#seeing();
    this.#resolveLoaded();
  }

  /** @param {HTMLElement} content */
  #show(content) {
    const shown = /** @type {HTMLElement|null} */ (this.#cover.firstElementChild);
    // The stream repeats itself; what is being read or pressed must not be exchanged under the hand.
    if (!this.#cover.hidden && shown?.dataset.said === content.dataset.said) return;
    fill(this.#cover, content);
    this.#cover.hidden = false;
  }
}

/**
 * @param {ViewKind} kind Which is shown.
 * @param {(kind: ViewKind) => void} choose
 */
export function viewSwitch(kind, choose) {
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
      for (const each of buttons) each.setAttribute("aria-pressed", String(each === element));
      choose(is);
    };
    const element = h("button", { type: "button", title, "aria-pressed": String(is === kind), data: { view: is }, on: { click: press } }, text);
    return element;
  }
  return h("div", { class: "view-switch", role: "group", "aria-label": "View" }, buttons);
}

function skeleton() {
  return h("div", { class: "skeleton-scene", role: "img", "aria-label": "Loading the scene", data: { said: "loading" } }, h("div", { class: "shimmer" }));
}
