/** A stream of messages of a session, a sweep or a class: a websocket that reconnects by itself, after growing delays, or at once when the
 * browser is online or visible again.
 *
 * The first message after every connection has the whole state, so nothing has to be remembered here. A connection counts as lost when it
 closes or a ping stays unanswered (a laptop that slept, a dead tunnel). */

import { absolute, addressOf, ApiError } from "./api.js";
import { toast } from "./dom.js";

/** @import { Given, Route } from "./api.js" */

// Sockets of the server: their addresses, and the delay before the next attempt.

const FIRST_WAIT_MS = 250;
const LONGEST_WAIT_MS = 4000;

/**
 * The address of a socket.
 *
 * @template {Route} R
 * @param {R} route
 * @param {Given<R>} given
 */
export function socketAddress(route, ...given) {
  return absolute(addressOf(route, ...given)).replace(/^http/, "ws");
}

/** Delay before the next attempt: longer each time, and random, so that pages do not reconnect at once. */
export class Backoff {
  #wait = FIRST_WAIT_MS;

  /** Reset after a successful attempt. */
  reset() {
    this.#wait = FIRST_WAIT_MS;
  }

  /** @returns {number} The present delay, ms. */
  next() {
    const wait = this.#wait * (0.75 + Math.random() / 2);
    this.#wait = Math.min(this.#wait * 2, LONGEST_WAIT_MS);
    return wait;
  }
}

const PING_EVERY_MS = 5000;
/** Statuses of a stream that no longer exists. */
const IS_GONE = [401, 403, 404, 410];
/** Offset of HTTP statuses in close codes. */
const CODES_FROM = 4000;
/** The close code of a broken or failed connection. */
const BROKEN = 1006;
const NOT_PASSED_ON =
  "The server answers, but its live updates do not arrive: a proxy must pass on websockets, with the headers Host, Upgrade and Connection.";

/** The callbacks of a stream.
 *
 * @template Message
 * @typedef {object} Listener
 * @property {(message: Message) => void} message
 * @property {(drawing: ArrayBuffer) => void} [drawing] Called with binary messages.
 * @property {() => void} [opened] Called on a new connection.
 * @property {() => void} lost
 * @property {(event: CloseEvent) => void} [closed] Called before that, if the server closed it with a reason.
 * @property {(error: ApiError) => void} gone Called when the server answers, but the stream no longer exists.
 */

/** @template {{type: string}} Message */
export class Stream {
  #on;
  #address;
  #look;
  /** @type {WebSocket|null} */
  #socket = null;
  #backoff = new Backoff();
  #timer = 0;
  #isGreeted = false;
  /** Consecutive failed connections although the server answers. */
  #refusals = 0;
  #pings = 0;
  #unanswered = 0;
  #end = new AbortController();

  /**
   * @param {Listener<Message>} on
   * @param {{address: () => string, look: () => Promise<unknown>, signal?: AbortSignal}} what Its address, read before each connection, and
   a check whether it still exists; `signal` stops it. */
  constructor(on, { address, look, signal }) {
    this.#on = on;
    this.#address = address;
    this.#look = look;
    const end = this.#end.signal;
    signal?.addEventListener("abort", () => this.stop());
    globalThis.addEventListener("online", () => this.#soon(0), { signal: end });
    document.addEventListener("visibilitychange", () => !document.hidden && this.#soon(0), { signal: end });
    this.#connect();
  }

  /** End the stream; no callback follows. */
  stop() {
    this.#end.abort();
    clearTimeout(this.#timer);
    this.#leave();
  }

  /**
   * Send a message; without a connection, do nothing.
   *
   * @param {Record<string, string|number>} words
   */
  send(words) {
    if (this.#socket?.readyState === WebSocket.OPEN) this.#socket.send(JSON.stringify(words));
  }

  /** Connect again at once, because the address has changed; ignore the old connection. */
  again() {
    this.#leave();
    this.#soon(0);
  }

  /** Ignore the present connection from now on, and close it. */
  #leave() {
    const socket = this.#socket;
    this.#socket = null;
    clearInterval(this.#pings);
    // A browser logs an error if a socket is closed before it opens.
    if (socket?.readyState === WebSocket.CONNECTING) socket.addEventListener("open", () => socket.close());
    else socket?.close();
  }

  #connect() {
    if (this.#end.signal.aborted || this.#socket !== null) return;
    const socket = new WebSocket(this.#address());
    this.#socket = socket;
    socket.binaryType = "arraybuffer";
    const isHeard = () => socket === this.#socket;
    socket.addEventListener("open", () => isHeard() && this.#opened());
    socket.addEventListener("message", ({ data }) => isHeard() && this.#receive(data));
    socket.addEventListener("close", (event) => isHeard() && this.#closed(event));
  }

  #opened() {
    this.#on.opened?.();
    this.#unanswered = 0;
    this.#pings = setInterval(() => this.#ping(), PING_EVERY_MS);
  }

  #ping() {
    if (this.#unanswered < 2) {
      this.#unanswered += 1;
      this.send({ version: 1, type: "ping", sent: Math.round(performance.now()) });
      return;
    }
    // close() alone would wait for the other side's answer, which does not come.
    this.#closed(null);
  }

  /** @param {string|ArrayBuffer} data */
  #receive(data) {
    const message = typeof data === "string" ? JSON.parse(data) : null;
    if (message?.type === "pong") {
      this.#unanswered = 0;
      return;
    }
    this.#isGreeted = true;
    this.#backoff.reset();
    if (typeof data === "string") this.#on.message(message);
    else this.#on.drawing?.(data);
  }

  /** @param {CloseEvent|null} event Null if the page gave it up. */
  async #closed(event) {
    this.#leave();
    const wasGreeted = this.#isGreeted;
    this.#isGreeted = false;
    if (event !== null) this.#on.closed?.(event);
    if (this.#end.signal.aborted) return;
    this.#on.lost();
    const status = (event?.code ?? 0) - CODES_FROM;
    const told = IS_GONE.includes(status) ? new ApiError(status, { message: event?.reason ?? "" }) : null;
    // After a greeting, a stopping server sends the same code.
    const error = wasGreeted ? null : (told ?? (await this.#look().then(() => null, (failure) => failure)));
    this.#refusals = !wasGreeted && error === null && event?.code === BROKEN ? this.#refusals + 1 : 0;
    if (this.#refusals === 2) toast(NOT_PASSED_ON, { kind: "error" });
    if (error instanceof ApiError && IS_GONE.includes(error.status)) {
      this.stop();
      this.#on.gone(error);
    } else this.#soon(this.#backoff.next());
  }

  /** @param {number} milliseconds */
  #soon(milliseconds) {
    if (this.#end.signal.aborted || this.#socket !== null) return;
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => this.#connect(), milliseconds);
  }
}
