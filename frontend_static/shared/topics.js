/** Topics that a store tells of: views listen to some of them and look at the fields that they draw. */

/** @template {string} Topic */
export class Topics {
  /** @type {Map<Topic, Set<() => void>>} */
  #listeners = new Map();

  /**
   * Call `listener` after each change of any of the topics.
   *
   * @param {readonly Topic[]} topics
   * @param {() => void} listener
   * @param {AbortSignal} [signal] Until then.
   */
  on(topics, listener, signal) {
    for (const topic of topics) {
      const those = this.#listeners.get(topic) ?? new Set();
      this.#listeners.set(topic, those.add(listener));
      signal?.addEventListener("abort", () => those.delete(listener));
    }
  }

  /**
   * Say that something of these topics has changed.
   *
   * @param {...Topic} topics
   */
  tell(...topics) {
    for (const topic of topics) for (const listener of this.#listeners.get(topic) ?? []) listener();
  }
}
