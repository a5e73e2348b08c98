/**
 * A websocket that comes back by itself: after a while that grows, or at once when the browser is online or in sight again.
 */

import { Backoff } from "./socket.js";

/**
 * Who hears of a socket.
 *
 * @template {string|ArrayBuffer} Data
 * @typedef {object} Listener
 * @property {() => void} [open] There is a new connection.
 * @property {(data: Data) => void} message
 * @property {(event: CloseEvent|null) => boolean|Promise<boolean>} closed Whether it comes back; null where it was given up.
 */

/** @template {string|ArrayBuffer} Data What comes over it. */
export class ReconnectingSocket {
  #address;
  #on;
  #signal;
  /** @type {WebSocket|null} */
  #socket = null;
  #backoff = new Backoff();
  #timer = 0;
  /** Whether it stays away. */
  #isOver = false;

  /**
   * @param {() => string} address Asked for before each try.
   * @param {Listener<Data>} on
   * @param {AbortSignal} signal Ends it; nothing is told after that.
   */
  constructor(address, on, signal) {
    this.#address = address;
    this.#on = on;
    this.#signal = signal;
    signal.addEventListener("abort", () => {
      clearTimeout(this.#timer);
      this.#socket?.close();
    });
    globalThis.addEventListener("online", () => this.#soon(0), { signal });
    document.addEventListener("visibilitychange", () => !document.hidden && this.#soon(0), { signal });
    this.#connect();
  }

  /** The connection is a good one: the next try need not wait long. */
  succeeded() {
    this.#backoff.reset();
  }

  /**
   * Send a message, unless there is no connection.
   *
   * @param {Record<string, string|number>} message
   */
  send(message) {
    if (this.#socket?.readyState === WebSocket.OPEN) this.#socket.send(JSON.stringify(message));
  }

  /** Take the connection for dead: close() would wait for the other side's farewell, which is just what does not come. */
  giveUp() {
    const socket = this.#socket;
    if (socket === null) return;
    this.#closed(socket, null);
    socket.close();
  }

  #connect() {
    if (this.#signal.aborted || this.#socket !== null) return;
    const socket = new WebSocket(this.#address());
    this.#socket = socket;
    socket.binaryType = "arraybuffer";
    const isHeard = () => socket === this.#socket && !this.#signal.aborted;
    socket.addEventListener("open", () => isHeard() && this.#on.open?.());
    socket.addEventListener("message", ({ data }) => isHeard() && this.#on.message(data));
    socket.addEventListener("close", (event) => this.#closed(socket, event));
  }

  /**
   * @param {WebSocket} socket
   * @param {CloseEvent|null} event
   */
  async #closed(socket, event) {
    if (socket !== this.#socket) return;
    this.#socket = null;
    if (this.#signal.aborted) return;
    this.#isOver = !(await this.#on.closed(event));
    this.#soon(this.#backoff.next());
  }

  /** @param {number} milliseconds */
  #soon(milliseconds) {
    if (this.#isOver || this.#signal.aborted || this.#socket !== null) return;
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => this.#connect(), milliseconds);
  }
}
