/**
 * An exploration: work of the server beside a session, which is asked again and again for what it has found, and ended when
 * nobody wants to know any more.
 */

import { messageOf, pathOf, request, statusOf } from "../../shared/api.js";
import { after } from "../../shared/timing.js";

/** @import { ExplorationCreate, ExplorationPublic } from "../../shared/messages.js" */

const ASK_EVERY_MS = 250;
const sessions = pathOf("sessions");

/**
 * @typedef {object} Listener
 * @property {(told: ExplorationPublic) => void} found Hears what has been found so far, the last time with its end.
 * @property {(message: string) => void} failed
 */

export class Exploration {
  #session;
  #on;
  #signal;
  #wanted = 0;
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
    this.#signal = signal;
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
    if (before !== null) this.#cancel(before);
  }

  /** @param {ExplorationCreate} body */
  async #follow(body) {
    const mine = this.#wanted;
    const isWanted = () => mine === this.#wanted && !this.#signal.aborted;
    try {
      /** @type {ExplorationPublic} */
      let told = await request("POST", sessions(this.#session(), "explorations"), body);
      if (isWanted()) this.#id = told.id;
      else this.#cancel(told.id);
      while (isWanted()) {
        this.#on.found(told);
        if (told.state !== "computing") break;
        await after(ASK_EVERY_MS);
        if (isWanted()) told = (await this.#ask(told.id)) ?? told;
      }
    } catch (error) {
      if (isWanted()) this.#on.failed(messageOf(error));
    }
  }

  /** End what is under way. */
  stop() {
    this.#wanted += 1;
    if (this.#id !== null) this.#cancel(this.#id);
    this.#id = null;
  }

  /**
   * @param {string} id
   * @returns {Promise<ExplorationPublic|null>} Null where there was no answer: it can be asked again.
   */
  async #ask(id) {
    try {
      return await request("GET", sessions(this.#session(), "explorations", id));
    } catch (error) {
      if (statusOf(error) === 0) return null;
      throw error;
    }
  }

  /** @param {string} id */
  #cancel(id) {
    request("DELETE", sessions(this.#session(), "explorations", id)).catch(() => {});
  }
}
