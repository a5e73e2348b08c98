/** Which layers of a session's drawings are shown; views paint by it, panels switch it. */

/** @import { Layer } from "../../shared/messages.js" */

export class Layers {
  /** @type {Map<string, boolean>} */
  #shown;
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
