/** What this browser keeps for a person. It may be told to keep nothing: then all lasts as long as the page. */

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
    // It lasts as long as the page.
  }
}
