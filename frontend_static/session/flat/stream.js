/**
 * The stream of a session's drawings: a websocket that comes back by itself.
 *
 * The server sends the newest drawing when the last but one has been painted, so the page says what it has painted. It
 * says so again and again: on a line that has died that makes the browser notice.
 */

const PATH = "/api/v1/sessions/";
const GONE = 4404;
const FIRST_WAIT_MS = 250;
const LONGEST_WAIT_MS = 4000;
const SAY_EVERY_MS = 5000;

/** @typedef {(message: ArrayBuffer, painted: () => void) => void} Receive `painted` tells the server that it was. */

export class DrawingStream {
  #address;
  #receive;
  #onGone;
  /** @type {WebSocket|null} */
  #socket = null;
  #wait = FIRST_WAIT_MS;
  #timer = 0;

  /**
   * @param {string} session
   * @param {Receive} receive
   * @param {() => void} onGone Called when the session has ended.
   */
  constructor(session, receive, onGone) {
    const scheme = location.protocol === "https:" ? "wss:" : "ws:";
    this.#address = `${scheme}//${location.host}${PATH}${encodeURIComponent(session)}/drawings`;
    this.#receive = receive;
    this.#onGone = onGone;
    this.#connect();
  }

  close() {
    clearTimeout(this.#timer);
    const socket = this.#socket;
    this.#socket = null;
    socket?.close();
  }

  #connect() {
    const socket = new WebSocket(this.#address);
    let came = 0;
    let painted = 0;
    const say = () => {
      if (socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify({ type: "painted", count: painted }));
    };
    const saying = setInterval(say, SAY_EVERY_MS);
    socket.binaryType = "arraybuffer";
    socket.addEventListener("message", ({ data }) => {
      if (socket !== this.#socket) return;
      this.#wait = FIRST_WAIT_MS;
      came += 1;
      const count = came;
      this.#receive(data, () => {
        painted = Math.max(painted, count);
        say();
      });
    });
    socket.addEventListener("close", ({ code }) => {
      clearInterval(saying);
      if (socket !== this.#socket) return;
      this.#socket = null;
      if (code === GONE) this.#onGone();
      else this.#again();
    });
    this.#socket = socket;
  }

  #again() {
    this.#timer = setTimeout(() => this.#connect(), this.#wait * (0.75 + Math.random() / 2));
    this.#wait = Math.min(this.#wait * 2, LONGEST_WAIT_MS);
  }
}
