/**
 * The frame that holds the 3-D scene, and what lies over it when there is no scene to see: loading, crashed, suspended,
 * gone, or a browser without 3-D graphics (which gets plain pictures instead).
 */

import { api } from "../shared/api.js";
import { fill, h } from "../shared/dom.js";
import { notice } from "../shared/notice.js";
import { isDark, onTheme } from "../shared/theme.js";
import { after, later, throttle } from "../shared/timing.js";
import { Preview } from "./preview.js";
import { viewerReady } from "./viewer_ready.js";

/** Later than elsewhere: a skeleton just before the picture would only make it flicker. */
const SKELETON_AFTER_MS = 500;
const PICTURES_EVERY_MS = 200;
/** How long the scene's script, which keeps the browser busy, waits for the picture that shall be seen before it. */
const PREVIEW_FIRST_MS = 400;

export class Scene {
  #root;
  #signal;
  #cover = h("div", { class: "cover", hidden: true });
  #frame = null;
  #preview = null;
  #pictures = null;
  #id = null;
  #shows = false;

  /**
   * @param {HTMLElement} root
   * @param {AbortSignal} signal Aborted when the scene is taken from the page.
   */
  constructor(root, signal) {
    this.#root = root;
    this.#signal = signal;
    fill(root, this.#cover);
    later(() => !this.#shows && this.#cover.hidden && this.#show(skeleton()), SKELETON_AFTER_MS, signal);
    onTheme(() => this.window?.postMessage({ source: "pftrack", theme: theme() }, location.origin), signal);
  }

  /** Resolves when there is a picture of the run to see, or will be none before the scene. */
  seen = new Promise((resolve) => {
    this.resolveSeen = resolve;
  });

  /** Resolves when the scene itself is drawn, or will never be. */
  drawn = new Promise((resolve) => {
    this.resolveDrawn = resolve;
  });

  get window() {
    return this.#frame?.contentWindow ?? null;
  }

  /** Show a session, of which nothing but its name has to be known, and whether it stands still at its beginning. */
  open(id, isFresh) {
    this.#id = id;
    this.#load(isFresh);
  }

  /**
   * Follow what becomes of the session.
   *
   * @param {import("./mount.js").Mounted} view
   */
  follow({ store, commands }) {
    let down = false;
    let alive = true;
    store.on("session connection", () => {
      if (store.connection === "lost") down = true;
      if (store.session === null || store.connection !== "open") return;
      const serves = !["starting", "suspended", "crashed"].includes(store.session.state);
      // A frame without focus does not look for its server again, and a revived worker has a new one: load it anew.
      if (serves && (down || !alive)) this.#load();
      alive = serves;
      if (this.#preview) this.#preview.stopped = !serves;
      if (serves) down = false;
      this.#state(store.session, commands);
    });
    store.on("position branches", () => {
      this.#preview?.refresh(store.session.playing);
      this.#pictures?.(store.session);
    });
  }

  /** Say that there is nothing to show, why, and the one way on. */
  fail(title, message, action) {
    this.#id = null;
    this.#settle();
    this.#frame?.remove();
    this.#show(notice(title, message, action));
  }

  #state(session, commands) {
    if (session.state === "crashed") {
      this.#show(notice("The tracker stopped", session.message ?? "Its process ended unexpectedly. Nothing up to this frame is lost.", {
        label: "Resume",
        run: () => commands.resume(),
      }));
    } else if (session.state === "suspended") {
      this.#show(notice("This session sleeps", session.message ?? "It was not used for a while. It goes on where it was.", {
        label: "Resume",
        run: () => commands.resume(),
      }));
    } else if (session.state === "starting") {
      if (this.#shows) this.#show(skeleton());
    } else if (this.#shows) {
      this.#cover.hidden = true;
    }
  }

  async #load(isFresh = false) {
    if (this.#pictures) return;
    const preview = new Preview(this.#id, isFresh, this.#signal);
    const isNewest = () => this.#preview === preview && !this.#signal.aborted;
    this.#preview?.element.remove();
    this.#preview = preview;
    this.#cover.before(preview.element);
    const first = preview.first.then(() => isNewest() && this.#seeing());
    await Promise.race([first, after(PREVIEW_FIRST_MS, this.#signal)]);
    this.resolveSeen();
    if (!isNewest()) return;
    if (!hasWebGl()) {
      this.#plain();
      return;
    }
    const frame = h("iframe", { src: `/viz/${encodeURIComponent(this.#id)}/?theme=${theme()}`, title: "Scene", class: "scene-frame", allow: "fullscreen" });
    if (this.#frame) this.#frame.replaceWith(frame);
    else this.#root.prepend(frame);
    this.#frame = frame;
    if (await viewerReady(frame, isNewest, this.#signal)) {
      this.#seeing();
      this.#settle();
    }
  }

  /** There is something to see now: nothing has to be said about loading any more. */
  #seeing() {
    this.#shows = true;
    if (!this.#cover.querySelector(".notice")) this.#cover.hidden = true;
  }

  /** No preview is needed any more. */
  #settle() {
    this.#shows = true;
    this.#preview?.element.remove();
    this.#preview = null;
    this.resolveSeen();
    this.resolveDrawn();
  }

  /** Pictures instead of a scene. */
  #plain() {
    const image = h("img", { class: "scene-picture", alt: "The current frame with what the tracker believes" });
    const ask = (query) => {
      image.src = `${api.frameAddress(this.#id)}?${query}`;
    };
    let now = null;
    const refresh = throttle(() => ask(`frame=${now.position}&branch=${now.branch}`), PICTURES_EVERY_MS, this.#signal);
    this.#pictures = (session) => {
      now = session;
      refresh();
    };
    ask("first");
    const hint = h("p", { class: "hint" }, "This browser offers no 3-D graphics (WebGL 2), so here are pictures. Turning hardware acceleration on, or another browser, brings the scene and its controls.");
    this.#root.prepend(h("div", { class: "scene-flat" }, image, hint));
    this.#seeing();
    this.#settle();
  }

  #show(content) {
    // The stream repeats itself; what is being read or pressed must not be exchanged under the hand.
    if (!this.#cover.hidden && this.#cover.firstElementChild?.dataset.said === content.dataset.said) return;
    fill(this.#cover, content);
    this.#cover.hidden = false;
  }
}

function skeleton() {
  return h("div", { class: "skeleton-scene", "aria-label": "Loading the scene", data: { said: "loading" } }, h("div", { class: "shimmer" }));
}

function theme() {
  return isDark() ? "dark" : "light";
}

function hasWebGl() {
  try {
    const context = document.createElement("canvas").getContext("webgl2");
    context?.getExtension("WEBGL_lose_context")?.loseContext();
    return context !== null;
  } catch {
    return false;
  }
}
