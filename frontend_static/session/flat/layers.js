/** Which layers of a session's drawings are shown, as signals; views paint by it, panels switch it. */

import { html, signal } from "../../vendor/preact.js";

/** @import { Layer } from "../../shared/messages.js" */
/** @import { DrawnKey } from "./decode.js" */

export class Layers {
  /** Whether each layer is shown, by name. */
  shown;
  #legend = signal(/** @type {readonly DrawnKey[]} */ ([]));

  /** @param {readonly Layer[]} [declared] A layer that is not among them is shown. */
  constructor(declared = []) {
    /** Those that can be seen from the front. */
    this.declared = declared.filter(({ role }) => role !== "through time");
    this.shown = signal(Object.fromEntries(declared.map(({ name, shown, role }) => [name, shown && role !== "through time"])));
  }

  /** @param {string} layer */
  isShown(layer) {
    return this.shown.value[layer] ?? true;
  }

  /**
   * @param {string} layer
   * @param {boolean} shown
   */
  set(layer, shown) {
    if (this.isShown(layer) !== shown) this.shown.value = { ...this.shown.peek(), [layer]: shown };
  }

  /** What the colours mean on layers that are shown, each meaning once. */
  get legend() {
    const shown = this.#legend.value.filter(({ layer }) => this.isShown(layer));
    return [...new Map(shown.map((key) => [`${key.colour} ${key.meaning}`, key])).values()];
  }

  /** @param {readonly DrawnKey[]} legend That of the drawing that is painted. */
  tell(legend) {
    const known = this.#legend.peek();
    const isSame = legend.length === known.length && legend.every(({ meaning }, place) => meaning === known[place].meaning);
    if (!isSame) this.#legend.value = legend;
  }
}

/**
 * What the colours mean that are drawn.
 *
 * @param {{layers: Layers}} props
 */
export function LayerLegend({ layers }) {
  const keys = layers.legend.map(({ colour, meaning }) => html`<li class="legend-key"><i style=${`background: var(--${colour})`}></i>${meaning}</li>`);
  return html`<ul class="legend" aria-label="Legend">${keys}</ul>`;
}
