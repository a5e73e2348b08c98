/** What a tab keeps beyond one page. Where the browser refuses to keep anything, it ends with the page. */

/** @template Value */
export class KeptInTab {
  #key;

  /** @param {string} key */
  constructor(key) {
    this.#key = key;
  }

  /** @returns {Value|null} */
  get() {
    try {
      return JSON.parse(sessionStorage.getItem(this.#key) ?? "null");
    } catch {
      return null;
    }
  }

  /** @param {Value|null} value Null to forget it. */
  set(value) {
    try {
      if (value === null) sessionStorage.removeItem(this.#key);
      else sessionStorage.setItem(this.#key, JSON.stringify(value));
    } catch {
      // Storage is full or disabled.
    }
  }
}
