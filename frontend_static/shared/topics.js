/** Topics that a store tells of: views listen to some of them and look at the fields that they draw. */

/** @template {string} Topic */
export class Topics {
  /** @type {Map<Topic, Set<() => void>>} */
  #listeners = new Map();
  /** @type {Set<(topics: readonly Topic[]) => void>} */
  #all = new Set();

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
   * Call `listener` after each change, with the topics of which something has changed.
   *
   * @param {(topics: readonly Topic[]) => void} listener
   */
  onAll(listener) {
    this.#all.add(listener);
  }

  /**
   * Say that something of these topics has changed; whoever listens to several of them is called once.
   *
   * @param {...Topic} topics
   */
  tell(...topics) {
    const listeners = new Set(topics.flatMap((topic) => [...(this.#listeners.get(topic) ?? [])]));
    for (const listener of listeners) listener();
    for (const listener of this.#all) listener(topics);
  }
}
