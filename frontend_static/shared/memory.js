/** What this browser keeps for a person, and a tab beyond one page. Where the browser keeps nothing, it lasts as long as the page. */

/**
 * @param {string} name
 * @returns {string|null}
 */
export function remembered(name) {
  try {
    return localStorage.getItem(name);
  } catch {
    return null;
  }
}

/**
 * @param {string} name
 * @param {string} value
 */
export function remember(name, value) {
  try {
    localStorage.setItem(name, value);
  } catch {
    // Storage is full or disabled.
  }
}

/**
 * What this tab keeps.
 *
 * @template Value
 */
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
