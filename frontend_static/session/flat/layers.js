/** Which layers of a session's drawings are shown; views paint by it, panels switch it. */

export class Layers {
  /** @type {Map<string, boolean>} */
  #shown;
  /** @type {Set<() => void>} */
  #listeners = new Set();

  /** @param {Record<string, boolean>} [shown] A layer that is not named is shown. */
  constructor(shown = {}) {
    this.#shown = new Map(Object.entries(shown));
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
