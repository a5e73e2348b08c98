/**
 * The stream of a session's drawings: a websocket that comes back by itself.
 *
 * The server sends the newest drawing when the last but one has been painted, so the page says what it has painted. It
 * says so again and again: on a line that has died that makes the browser notice.
 */

import { ReconnectingSocket } from "../../shared/reconnecting_socket.js";
import { GONE, socketAddress } from "../../shared/socket.js";

const SAY_EVERY_MS = 5000;

/**
 * @typedef {object} Listener
 * @property {(message: ArrayBuffer, painted: () => void) => void} drawing `painted` tells the server that it was painted,
 *     and so were all before it or will never be.
 * @property {() => void} gone The session has ended.
 */

/**
 * Receive a session's drawings until the signal.
 *
 * @param {string} session
 * @param {Listener} on
 * @param {AbortSignal} signal
 */
export function receiveDrawings(session, on, signal) {
  // Over one connection: how many came, and how many of them were painted.
  let known = { came: 0, painted: 0 };
  const address = () => socketAddress(`sessions/${encodeURIComponent(session)}/drawings`);
  const say = () => socket.send({ type: "painted", count: known.painted });
  const receive = (/** @type {ArrayBuffer} */ data) => {
    const mine = known;
    mine.came += 1;
    const count = mine.came;
    socket.succeeded();
    on.drawing(data, () => {
      if (mine !== known || count <= mine.painted) return;
      mine.painted = count;
      say();
    });
  };
  const closed = (/** @type {CloseEvent|null} */ event) => {
    if (event?.code !== GONE) return true;
    on.gone();
    return false;
  };
  const open = () => {
    known = { came: 0, painted: 0 };
  };
  /** @type {ReconnectingSocket<ArrayBuffer>} */
  const socket = new ReconnectingSocket(address, { open, message: receive, closed }, signal);
  const saying = setInterval(say, SAY_EVERY_MS);
  signal.addEventListener("abort", () => clearInterval(saying));
}
