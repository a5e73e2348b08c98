/**
 * A stream of messages, a session's or a sweep's: a websocket that comes back by itself.
 *
 * The first message after every connection is `hello` with the whole state, so nothing has to be remembered here. A
 * connection counts as lost when it closes or when a ping stays unanswered (a laptop that slept, a dead tunnel).
 */

import { ApiError, api } from "./api.js";
import { Backoff, socketAddress } from "./socket.js";

const PING_EVERY_MS = 5000;

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
  #address;
  #look;
  #on;
  /** @type {WebSocket|null} */
  #socket = null;
  #backoff = new Backoff();
  #timer = 0;
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
    this.#address = address;
    this.#look = look;
    this.#on = on;
    signal?.addEventListener("abort", () => this.stop());
    const until = { signal: this.#end.signal };
    globalThis.addEventListener("online", () => this.#soon(0), until);
    document.addEventListener("visibilitychange", () => !document.hidden && this.#socket === null && this.#soon(0), until);
    this.#connect();
  }

  stop() {
    this.#end.abort();
    clearTimeout(this.#timer);
    clearInterval(this.#pings);
    this.#socket?.close();
  }

  #connect() {
    if (this.#end.signal.aborted || this.#socket !== null) return;
    const socket = new WebSocket(this.#address());
    this.#socket = socket;
    let greeted = false;
    socket.addEventListener("message", (event) => {
      if (this.#end.signal.aborted) return;
      const message = JSON.parse(event.data);
      if (message.type === "pong") {
        this.#unanswered = 0;
        return;
      }
      if (message.type === "hello") {
        greeted = true;
        this.#backoff.reset();
      }
      this.#on.message(message);
    });
    socket.addEventListener("open", () => this.#watch(socket));
    socket.addEventListener("close", (event) => {
      if (!this.#end.signal.aborted) this.#on.closed?.(event);
      this.#closed(socket, greeted);
    });
  }

  /** @param {WebSocket} socket */
  #watch(socket) {
    this.#unanswered = 0;
    clearInterval(this.#pings);
    this.#pings = setInterval(() => {
      if (this.#unanswered >= 2) {
        // close() would wait for the other side's farewell, which is just what does not come.
        this.#closed(socket, true);
        socket.close();
        return;
      }
      this.#unanswered += 1;
      if (socket.readyState === WebSocket.OPEN) {
        socket.send(JSON.stringify({ version: 1, type: "ping", sent: Math.round(performance.now()) }));
      }
    }, PING_EVERY_MS);
  }

  /**
   * @param {WebSocket} socket
   * @param {boolean} greeted
   */
  async #closed(socket, greeted) {
    if (socket !== this.#socket) return;
    this.#socket = null;
    clearInterval(this.#pings);
    if (this.#end.signal.aborted) return;
    this.#on.lost();
    if (!greeted) {
      const error = await this.#look().then(() => null, (failure) => failure);
      if (error instanceof ApiError && [401, 403, 404, 410].includes(error.status)) {
        this.stop();
        this.#on.gone(error);
        return;
      }
    }
    this.#soon(this.#backoff.next());
  }

  /** @param {number} milliseconds */
  #soon(milliseconds) {
    clearTimeout(this.#timer);
    if (this.#end.signal.aborted) return;
    this.#timer = setTimeout(() => this.#connect(), milliseconds);
  }
}
