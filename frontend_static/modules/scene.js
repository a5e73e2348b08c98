/**
 * The frame that holds the 3-D scene, and what lies over it when there is no scene to see: loading, crashed, suspended,
 * gone, or a browser without 3-D graphics (which gets plain pictures instead).
 */

import { api } from "./api.js";
import { fill, h } from "./dom.js";
import { throttle } from "./pace.js";
import { isDark, onTheme } from "./theme.js";

const SKELETON_AFTER_MS = 200;
const PICTURES_EVERY_MS = 200;

export class Scene {
  #root;
  #cover = h("div", { class: "cover", hidden: true });
  #frame = null;
  #address = null;
  #loaded = false;

  /**
   * @param {HTMLElement} root
   * @param {import("./store.js").Store} store
   * @param {import("./commands.js").Commands} commands
   */
  constructor(root, store, commands) {
    this.#root = root;
    fill(root, this.#cover);
    setTimeout(() => {
      if (!this.#loaded && this.#cover.hidden) this.#show(skeleton());
    }, SKELETON_AFTER_MS);
    onTheme(() => this.window?.postMessage({ source: "pftrack", theme: theme() }, location.origin));
    let down = false;
    let alive = true;
    store.on("session connection", () => {
      if (store.connection === "lost") down = true;
      if (store.session === null || store.connection !== "open") return;
      const { state, viewer } = store.session;
      const serves = !["starting", "suspended", "crashed"].includes(state);
      // A frame without focus does not look for its server again, and a revived worker has a new one: load it anew.
      if (serves && (this.#address !== viewer || down || !alive)) this.#load(viewer, store);
      alive = serves;
      if (serves) down = false;
      this.#state(store.session, commands);
    });
  }

  get window() {
    return this.#frame?.contentWindow ?? null;
  }

  /** Resolves when the scene's page is there. */
  ready = new Promise((resolve) => {
    this.resolveReady = resolve;
  });

  /** Say that there is nothing to show, why, and the one way on. */
  fail(title, message, action) {
    this.#loaded = true;
    this.#show(notice(title, message, action));
  }

  #state(session, commands) {
    if (session.state === "crashed") {
      this.#show(notice("The tracker stopped", session.message ?? "Its process ended unexpectedly. Nothing up to this frame is lost.", {
        label: "Restart from here",
        run: () => commands.resume(),
      }));
    } else if (session.state === "suspended") {
      this.#show(notice("This session sleeps", session.message ?? "It was not used for a while. It goes on where it was.", {
        label: "Resume",
        run: () => commands.resume(),
      }));
    } else if (session.state === "starting") {
      if (!this.#loaded) return;
      this.#show(skeleton());
    } else if (this.#loaded) {
      this.#cover.hidden = true;
    }
  }

  #load(viewer, store) {
    this.#address = viewer;
    if (!hasWebGl()) {
      this.#pictures(store);
      return;
    }
    const old = this.#frame;
    this.#frame = h("iframe", { src: `${viewer}?theme=${theme()}`, title: "Scene", class: "scene-frame", allow: "fullscreen" });
    this.#frame.addEventListener("load", () => {
      this.#loaded = true;
      if (!this.#cover.querySelector(".notice")) this.#cover.hidden = true;
      this.resolveReady();
    });
    if (old) old.replaceWith(this.#frame);
    else this.#root.prepend(this.#frame);
  }

  #pictures(store) {
    this.#loaded = true;
    this.resolveReady();
    const image = h("img", { class: "scene-picture", alt: "The current frame with what the tracker believes" });
    const refresh = throttle(() => {
      image.src = `${api.frameAddress(store.session.id)}?frame=${store.session.position}&branch=${store.session.branch}`;
    }, PICTURES_EVERY_MS);
    store.on("position branches", refresh);
    refresh();
    const hint = h("p", { class: "hint" }, "This browser offers no 3-D graphics (WebGL 2), so here are pictures. Turning hardware acceleration on, or another browser, brings the scene and its controls.");
    this.#root.prepend(h("div", { class: "scene-flat" }, image, hint));
    this.#cover.hidden = true;
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

function notice(title, message, action) {
  return h(
    "div",
    { class: "notice", role: "alert", data: { said: `${title} ${message}` } },
    h("h2", {}, title),
    h("p", {}, message),
    action.href
      ? h("a", { class: "button primary", href: action.href }, action.label)
      : h("button", { type: "button", class: "primary", on: { click: action.run } }, action.label),
  );
}

function theme() {
  return isDark() ? "dark" : "light";
}

function hasWebGl() {
  try {
    return document.createElement("canvas").getContext("webgl2") !== null;
  } catch {
    return false;
  }
}
