/**
 * The stream of a session's drawings: a websocket that comes back by itself.
 *
 * The server sends the newest drawing when the last but one has been painted, so the page says what it has painted. It
 * says so again and again: on a line that has died that makes the browser notice.
 */

import { Backoff, GONE, socketAddress } from "../../shared/socket.js";
import { after } from "../../shared/timing.js";

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
export async function receiveDrawings(session, on, signal) {
  const address = socketAddress(`sessions/${encodeURIComponent(session)}/drawings`);
  const backoff = new Backoff();
  while (!signal.aborted) {
    const { code, came } = await connection(address, on, signal);
    if (signal.aborted) return;
    if (code === GONE) {
      on.gone();
      return;
    }
    if (came) backoff.reset();
    await after(backoff.next(), signal);
  }
}

/**
 * Receive drawings over one connection until it ends.
 *
 * @param {string} address
 * @param {Listener} on
 * @param {AbortSignal} signal
 * @returns {Promise<{code: number, came: boolean}>} Why it ended, and whether anything came over it.
 */
function connection(address, on, signal) {
  return new Promise((resolve) => {
    const socket = new WebSocket(address);
    let came = 0;
    let painted = 0;
    const say = () => {
      if (socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify({ type: "painted", count: painted }));
    };
    const saying = setInterval(say, SAY_EVERY_MS);
    const hangUp = () => socket.close();
    signal.addEventListener("abort", hangUp);
    socket.binaryType = "arraybuffer";
    socket.addEventListener("message", ({ data }) => {
      if (signal.aborted) return;
      came += 1;
      const count = came;
      on.drawing(data, () => {
        if (count <= painted) return;
        painted = count;
        say();
      });
    });
    socket.addEventListener("close", ({ code }) => {
      clearInterval(saying);
      signal.removeEventListener("abort", hangUp);
      resolve({ code, came: came > 0 });
    });
  });
}
