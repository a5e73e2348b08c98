/** The flat view with its panel of parameters beside it, or behind a button where there is little room. */

import { h } from "../../shared/dom.js";
import { Panel } from "../panel/panel.js";
import { Layers } from "./layers.js";
import { mount } from "./mount.js";

/** @import { SessionPublic } from "../../shared/messages.js" */

export class FlatScene {
  #stage = h("div", { class: "flat-stage" });
  #controls = h("aside", { class: "controls", "aria-label": "Parameters" });
  #opener = h(
    "button",
    { type: "button", class: "controls-opener", "aria-expanded": "false", on: { click: () => this.#toggle() } },
    "Parameters",
  );
  #on;
  #signal;
  #hasPanel;
  /** @type {import("../store.js").Store|null} */
  #store = null;
  #overlay;
  /** @type {Promise<Layers>} */
  #layers;

  element = h("div", { class: "flat-scene" }, this.#stage);
  window = null;

  /**
   * @param {string} id The session.
   * @param {Promise<SessionPublic>} session What else is known of it.
   * @param {import("../scene.js").Progress} on
   * @param {AbortSignal} signal
   * @param {{hasPanel: boolean, layers: readonly string[], overlay?: import("./overlay.js").Overlay}} options Names of layers to show
   *     from the beginning, beside those declared so, and what says how it is painted where several lie over each other.
   */
  constructor(id, session, on, signal, { hasPanel, layers: named, overlay }) {
    this.#on = on;
    this.#signal = signal;
    this.#hasPanel = hasPanel;
    this.#overlay = overlay;
    if (hasPanel) this.element.append(this.#controls, this.#opener);
    else this.element.classList.add("bare");
    // Without knowing which layers are shown the first picture would flash all of them.
    this.#layers = session.then(({ layers }) => new Layers(layers.map((layer) => ({ ...layer, shown: layer.shown || named.includes(layer.name) }))));
    this.#layers.then((layers) => this.#show(id, layers), () => {});
  }

  /**
   * Follow what becomes of the session.
   *
   * @param {import("../mount.js").Mounted} view
   */
  follow({ store }) {
    this.#store = store;
    if (!this.#hasPanel) return;
    let isMade = false;
    const make = async () => {
      if (isMade || store.session === null) return;
      isMade = true;
      const layers = await this.#layers;
      if (!this.#signal.aborted) new Panel(this.#controls, store, layers, this.#signal);
    };
    store.on(["session"], make);
    make();
  }

  /**
   * @param {string} session
   * @param {Layers} layers
   */
  #show(session, layers) {
    if (this.#signal.aborted) return;
    const on = { onReady: (/** @type {number} */ frame) => this.#store?.show(frame), onPainted: () => this.#on.drawn() };
    this.#signal.addEventListener("abort", mount(this.#stage, { session, layers, overlay: this.#overlay, ...on }));
  }

  #toggle() {
    const open = this.element.toggleAttribute("data-open");
    this.#opener.setAttribute("aria-expanded", String(open));
    this.#opener.textContent = open ? "Close" : "Parameters";
  }
}
