/**
 * Addresses. The server may lie below any path, and a class below its link: the `<base>` of each page says where, and
 * all addresses in pages and scripts are relative to that, as in `session/1f`. So a bare `#there` would lead to another page.
 */

/** The start page, or that of the class for a participant. */
export const START = "./";

/**
 * An address as it can be opened elsewhere.
 *
 * @param {string} address Relative to that of the server.
 */
export function absolute(address) {
  return new URL(address, document.baseURI).href;
}

/**
 * A place on this page.
 *
 * @param {string} fragment
 */
export function here(fragment) {
  return `${location.pathname}${location.search}#${fragment}`;
}
