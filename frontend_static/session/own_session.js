/**
 * A session that belongs to what shows it: it begins with that, and ends with it, on the server as well, also when the page
 * is left. One that is left before it has begun is ended by the server, which sees that nobody waits for it; or, where its
 * answer was under way, by its name, which is chosen here.
 */

import { ROOT } from "../shared/api.js";
import { SessionStart } from "./session_start.js";

export class OwnSession {
  #left = new AbortController();
  #hasBegun = false;

  /**
   * @param {HTMLElement} element What holds the session.
   * @param {import("./session_start.js").Beginning} beginning
   */
  constructor(element, beginning) {
    const name = newName();
    this.start = new SessionStart(element, { ...beginning, name });
    this.start.begun.then(() => (this.#hasBegun = true), () => {});
    const leave = () => {
      this.end();
      if (beginning.recipe && !this.#hasBegun) remove(name);
    };
    // Also when the page goes where it could be brought back from: it is begun anew then.
    globalThis.addEventListener("pagehide", leave, { signal: this.#left.signal });
  }

  /** End it. */
  end() {
    if (this.#left.signal.aborted) return;
    this.#left.abort();
    this.start.end();
    this.start.begun.then(({ session }) => remove(session.id), () => {});
  }
}

/** @returns {string} A name that a session may have, and no other has. */
function newName() {
  const bytes = globalThis.crypto.getRandomValues(new Uint8Array(8));
  return [...bytes].map((byte) => byte.toString(16).padStart(2, "0")).join("");
}

/**
 * Ask for it in a way that outlives the page.
 *
 * @param {string} session
 */
function remove(session) {
  fetch(`${ROOT}sessions/${encodeURIComponent(session)}`, { method: "DELETE", keepalive: true }).catch(() => {});
}
