/**
 * A session that belongs to what shows it: it begins with that, and ends with it, on the server as well, also when the page
 * is left. One that is left before it has begun is ended by the server, which sees that nobody waits for it.
 */

import { ROOT } from "../shared/api.js";
import { SessionStart } from "./session_start.js";

export class OwnSession {
  #left = new AbortController();

  /**
   * @param {HTMLElement} element What holds the session.
   * @param {import("./session_start.js").Beginning} beginning
   */
  constructor(element, beginning) {
    this.start = new SessionStart(element, beginning);
    // Also when the page goes where it could be brought back from: it is begun anew then.
    globalThis.addEventListener("pagehide", () => this.end(), { signal: this.#left.signal });
  }

  /** End it. */
  end() {
    if (this.#left.signal.aborted) return;
    this.#left.abort();
    this.start.end();
    this.start.begun.then(({ session }) => remove(session.id), () => {});
  }
}

/**
 * Ask for it in a way that outlives the page.
 *
 * @param {string} session
 */
function remove(session) {
  fetch(`${ROOT}sessions/${encodeURIComponent(session)}`, { method: "DELETE", keepalive: true }).catch(() => {});
}
