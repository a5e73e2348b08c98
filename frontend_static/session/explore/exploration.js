/**
 * An exploration: work of the server beside a session, which is asked again and again for what it has found, and ended when
 * nobody wants to know any more.
 */

import { messageOf, pathOf, request } from "../../shared/api.js";
import { cancelJob, followJob } from "../../shared/jobs.js";

/** @import { ExplorationCreate, ExplorationJob } from "../../shared/messages.js" */

const sessions = pathOf("sessions");

/**
 * @typedef {object} Listener
 * @property {(told: ExplorationJob) => void} found Hears what has been found so far, the last time with its end.
 * @property {(message: string) => void} failed
 */

export class Exploration {
  #session;
  #on;
  #wanted = new AbortController();
  /** @type {string|null} What is under way. */
  #id = null;

  /**
   * @param {() => string} session Its name.
   * @param {Listener} on
   * @param {AbortSignal} signal It ends with it.
   */
  constructor(session, on, signal) {
    this.#session = session;
    this.#on = on;
    signal.addEventListener("abort", () => this.stop());
    // Who leaves the page does not wait for answers.
    globalThis.addEventListener("pagehide", () => this.stop(), { signal });
  }

  /**
   * Begin; what was under way ends.
   *
   * @param {ExplorationCreate} body
   */
  async begin(body) {
    this.stop();
    await this.#follow(body);
  }

  /**
   * Begin with what the one before has found.
   *
   * @param {ExplorationCreate} body
   */
  async goOn(body) {
    const before = this.#id;
    this.#id = null;
    this.stop();
    await this.#follow({ ...body, after: before });
    if (before !== null) cancelJob(before);
  }

  /** @param {ExplorationCreate} body */
  async #follow(body) {
    const wanted = (this.#wanted = new AbortController());
    try {
      /** @type {ExplorationJob} */
      const begun = await request("POST", sessions(this.#session(), "explorations"), body);
      if (wanted.signal.aborted) {
        cancelJob(begun.id);
        return;
      }
      this.#id = begun.id;
      this.#on.found(begun);
      await followJob(begun, (now) => now && this.#on.found(now), wanted.signal);
    } catch (error) {
      if (!wanted.signal.aborted) this.#on.failed(messageOf(error));
    }
  }

  /** End what is under way. */
  stop() {
    this.#wanted.abort();
    if (this.#id !== null) cancelJob(this.#id);
    this.#id = null;
  }
}
