/**
 * A session on lease: started when a lesson shows it, ended when the lesson is left. One that could not be ended, as when
 * the browser was killed, is taken up again by the same tab.
 */

import { ROOT, api } from "../shared/api.js";
import { SessionStart } from "../session/session_start.js";

/** @import { NewSession } from "../shared/share_link.js" */
/** @import { Part } from "../session/layout.js" */

/** @type {readonly Part[]} */
const PARTS = ["scene", "plots", "transport", "scrubber"];

export class Lease {
  #place;
  #end = new AbortController();
  /** @type {string|null} */
  #id = null;

  /** @param {string} name What it is for: among all that a tab shows. */
  constructor(name) {
    this.#place = `pftrack-lesson ${name}`;
    // Also when the page goes where it could be brought back from: it is begun anew then.
    globalThis.addEventListener("pagehide", () => this.end(), { signal: this.#end.signal });
  }

  /**
   * Begin the session in an element.
   *
   * @param {HTMLElement} element
   * @param {NewSession} recipe
   * @param {readonly string[]} layers That are shown from the beginning, beside those that the experiment shows.
   */
  async begin(element, recipe, layers) {
    const kept = await this.#kept();
    const start = new SessionStart(element, { ...(kept === null ? { recipe } : { session: kept }), parts: PARTS, view: "flat", layers });
    start.begun.then(({ session }) => this.#has(session.id), () => {});
    return start;
  }

  /** End it, on the server as well. */
  end() {
    this.#end.abort();
    if (this.#id !== null) release(this.#id);
    this.#id = null;
    store(this.#place, null);
  }

  /** @param {string} id */
  #has(id) {
    if (this.#end.signal.aborted) {
      release(id);
      return;
    }
    this.#id = id;
    store(this.#place, id);
  }

  /** @returns {Promise<string|null>} */
  async #kept() {
    let kept = null;
    try {
      kept = sessionStorage.getItem(this.#place);
    } catch {
      // Without storage none can be taken up again.
    }
    return kept === null ? null : api.session(kept).then(({ id }) => id, () => null);
  }
}

/**
 * End a session for good, also while the page is being left.
 *
 * @param {string} id
 */
function release(id) {
  fetch(`${ROOT}sessions/${encodeURIComponent(id)}`, { method: "DELETE", keepalive: true }).catch(() => {});
}

/**
 * @param {string} place
 * @param {string|null} id
 */
function store(place, id) {
  try {
    if (id === null) sessionStorage.removeItem(place);
    else sessionStorage.setItem(place, id);
  } catch {
    // See above.
  }
}
