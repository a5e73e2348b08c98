/** Which layers of a session's drawings are shown; views paint by it, panels switch it. */

/** @import { Layer } from "../../shared/messages.js" */
/** @import { DrawnKey } from "./decode.js" */

export class Layers {
  /** @type {Map<string, boolean>} */
  #shown;
  /** @type {readonly DrawnKey[]} */
  #legend = [];
  /** @type {Set<() => void>} */
  #listeners = new Set();

  /** @param {readonly Layer[]} [declared] A layer that is not among them is shown. */
  constructor(declared = []) {
    /** Those that can be seen from the front. */
    this.declared = declared.filter(({ role }) => role !== "through time");
    this.#shown = new Map(declared.map(({ name, shown, role }) => [name, shown && role !== "through time"]));
  }

  /** @param {string} layer */
  isShown(layer) {
    return this.#shown.get(layer) ?? true;
  }

  /**
   * @param {string} layer
   * @param {boolean} shown
   */
  set(layer, shown) {
    if (this.isShown(layer) === shown) return;
    this.#shown.set(layer, shown);
    for (const listener of this.#listeners) listener();
  }

  /** What the colours mean on layers that are shown, each meaning once. */
  get legend() {
    const shown = this.#legend.filter(({ layer }) => this.isShown(layer));
    return [...new Map(shown.map((key) => [`${key.colour} ${key.meaning}`, key])).values()];
  }

  /** @param {readonly DrawnKey[]} legend That of the drawing that is painted. */
  tell(legend) {
    const isSame = legend.length === this.#legend.length && legend.every(({ meaning }, place) => meaning === this.#legend[place].meaning);
    if (isSame) return;
    this.#legend = legend;
    for (const listener of this.#listeners) listener();
  }

  /**
   * Call `listener` after each change.
   *
   * @param {() => void} listener
   * @param {AbortSignal} signal Ends it.
   */
  on(listener, signal) {
    this.#listeners.add(listener);
    signal.addEventListener("abort", () => this.#listeners.delete(listener));
  }
}
