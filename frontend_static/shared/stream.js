/**
 * A stream of messages, a session's or a sweep's: a websocket that comes back by itself.
 *
 * The first message after every connection is `hello` with the whole state, so nothing has to be remembered here. A
 * connection counts as lost when it closes or when a ping stays unanswered (a laptop that slept, a dead tunnel).
 */

import { ApiError, api } from "./api.js";
import { ReconnectingSocket } from "./reconnecting_socket.js";
import { socketAddress } from "./socket.js";

const PING_EVERY_MS = 5000;
/** Statuses that say that there is no such stream any more. */
const IS_GONE = [401, 403, 404, 410];

/**
 * Who hears what comes over a stream.
 *
 * @template Message
 * @typedef {object} Listener
 * @property {(message: Message) => void} message
 * @property {() => void} lost
 * @property {(event: CloseEvent) => void} [closed] Called before that, where the server has ended it and said why.
 * @property {(error: ApiError) => void} gone The server answers, but there is no such stream any more.
 */

/** @template {{type: string}} Message */
export class Stream {
  #look;
  #on;
  /** @type {ReconnectingSocket<string>} */
  #socket;
  #isGreeted = false;
  #pings = 0;
  #unanswered = 0;
  #end = new AbortController();

  /**
   * @param {string} id The session.
   * @param {Listener<Message>} on
   * @param {{address?: () => string, look?: () => Promise<unknown>, signal?: AbortSignal}} [what] Another stream than a session's: where it is,
   *     and how to find out whether there still is one; `signal` stops it.
   */
  constructor(id, on, { address = () => socketAddress(`sessions/${encodeURIComponent(id)}/stream`), look = () => api.session(id), signal } = {}) {
    this.#look = look;
    this.#on = on;
    signal?.addEventListener("abort", () => this.stop());
    const heard = { open: () => this.#watch(), message: (/** @type {string} */ data) => this.#receive(JSON.parse(data)), closed: this.#closed.bind(this) };
    this.#socket = new ReconnectingSocket(address, heard, this.#end.signal);
  }

  stop() {
    this.#end.abort();
    clearInterval(this.#pings);
  }

  #watch() {
    this.#unanswered = 0;
    clearInterval(this.#pings);
    this.#pings = setInterval(() => {
      if (this.#unanswered >= 2) {
        this.#socket.giveUp();
        return;
      }
      this.#unanswered += 1;
      this.#socket.send({ version: 1, type: "ping", sent: Math.round(performance.now()) });
    }, PING_EVERY_MS);
  }

  /** @param {Message} message */
  #receive(message) {
    if (message.type === "pong") {
      this.#unanswered = 0;
      return;
    }
    if (message.type === "hello") {
      this.#isGreeted = true;
      this.#socket.succeeded();
    }
    this.#on.message(message);
  }

  /**
   * @param {CloseEvent|null} event
   * @returns {Promise<boolean>} Whether to try again.
   */
  async #closed(event) {
    clearInterval(this.#pings);
    const wasGreeted = this.#isGreeted;
    this.#isGreeted = false;
    if (event !== null) this.#on.closed?.(event);
    if (this.#end.signal.aborted) return false;
    this.#on.lost();
    if (wasGreeted) return true;
    const error = await this.#look().then(() => null, (failure) => failure);
    if (!(error instanceof ApiError && IS_GONE.includes(error.status))) return true;
    this.stop();
    this.#on.gone(error);
    return false;
  }
}
