/** Sockets of the server: where they are, and how long to wait before the next try. */

import { absolute } from "./address.js";
import { ROOT } from "./api.js";

const FIRST_WAIT_MS = 250;
const LONGEST_WAIT_MS = 4000;

/**
 * The address of a socket.
 *
 * @param {string} path Below that of the REST interface.
 */
export function socketAddress(path) {
  return absolute(ROOT + path).replace(/^http/, "ws");
}

/** Waiting before the next try: longer each time, and never of all pages at once. */
export class Backoff {
  #wait = FIRST_WAIT_MS;

  /** The last try was a success. */
  reset() {
    this.#wait = FIRST_WAIT_MS;
  }

  /** @returns {number} How long to wait now, ms. */
  next() {
    const wait = this.#wait * (0.75 + Math.random() / 2);
    this.#wait = Math.min(this.#wait * 2, LONGEST_WAIT_MS);
    return wait;
  }
}
