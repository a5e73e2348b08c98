/** The flat view with its panel of parameters beside it, or behind a button where there is little room. */

import { h } from "../../shared/dom.js";
import { Panel } from "../panel/panel.js";
import { Layers } from "./layers.js";
import { FlatView } from "./flat_view.js";

/** @import { SessionPublic } from "../../shared/messages.js" */

export class FlatScene {
  #stage = h("div", { class: "flat-stage" });
  #controls = h("aside", { class: "controls", "aria-label": "Parameters" });
  #opener = h(
    "button",
    { type: "button", class: "controls-opener", "aria-expanded": "false", on: { click: () => this.#toggle() } },
    "Parameters",
  );
  #signal;
  #hasPanel;
  /** @type {Promise<Layers>} */
  #layers;
  /** @type {Promise<FlatView>} */
  #view;

  /** Whether it shows a picture. */
  hasPicture = false;

  element = h("div", { class: "flat-scene" }, this.#stage);
  window = null;

  /**
   * @param {Promise<SessionPublic>} session What is known of it.
   * @param {import("../scene.js").Progress} on
   * @param {AbortSignal} signal
   * @param {{hasPanel: boolean, layers: readonly string[], overlay?: import("./overlay.js").Overlay}} options Names of layers to show
   *     from the beginning, beside those declared so, and what says how it is painted where several lie over each other.
   */
  constructor(session, on, signal, { hasPanel, layers: named, overlay }) {
    this.#signal = signal;
    this.#hasPanel = hasPanel;
    if (hasPanel) this.element.append(this.#controls, this.#opener);
    else this.element.classList.add("bare");
    // Without knowing which layers are shown the first picture would flash all of them.
    this.#layers = session.then(({ layers }) => new Layers(layers.map((layer) => ({ ...layer, shown: layer.shown || named.includes(layer.name) }))));
    const onPainted = () => {
      this.hasPicture = true;
      on.drawn();
    };
    this.#view = this.#layers.then((layers) => new FlatView(this.#stage, { layers, overlay, onPainted }, signal));
    // Why there is none is said for all of the session.
    this.#view.catch(() => {});
  }

  /**
   * Read a drawing and unpack its pictures.
   *
   * @param {ArrayBuffer} data As it has come.
   * @param {() => void} painted Called when it was painted, or will never be.
   */
  async prepare(data, painted) {
    return (await this.#view).prepare(data, painted);
  }

  /**
   * Follow what becomes of the session.
   *
   * @param {import("../mount.js").Mounted} view
   */
  follow({ store }) {
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

  #toggle() {
    const open = this.element.toggleAttribute("data-open");
    this.#opener.setAttribute("aria-expanded", String(open));
    this.#opener.textContent = open ? "Close" : "Parameters";
  }
}
