/**
 * The stream of a session's drawings: a websocket that comes back by itself.
 *
 * The server sends the newest drawing when the last but one has been painted, so the page says what it has painted. It
 * says so again and again: on a line that has died that makes the browser notice.
 */

import { after } from "../../shared/timing.js";

const PATH = "/api/v1/sessions/";
const GONE = 4404;
const FIRST_WAIT_MS = 250;
const LONGEST_WAIT_MS = 4000;
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
  const scheme = location.protocol === "https:" ? "wss:" : "ws:";
  const address = `${scheme}//${location.host}${PATH}${encodeURIComponent(session)}/drawings`;
  let wait = FIRST_WAIT_MS;
  while (!signal.aborted) {
    const { code, came } = await connection(address, on, signal);
    if (signal.aborted) return;
    if (code === GONE) {
      on.gone();
      return;
    }
    if (came) wait = FIRST_WAIT_MS;
    await after(wait * (0.75 + Math.random() / 2), signal);
    wait = Math.min(wait * 2, LONGEST_WAIT_MS);
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
