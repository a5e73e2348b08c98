/**
 * The scene in words, for whoever cannot see it: what the box of numbers says, as a sentence. It is told when the run stands,
 * not thirty times a second.
 */

import { h, setText } from "../shared/dom.js";
import { later } from "../shared/timing.js";
import { isMeasured, state, words } from "./readings.js";

const SETTLED_MS = 400;

/**
 * What is known of the frame that is shown.
 *
 * @param {import("./store.js").Store} store
 */
function frameInWords({ session, history }) {
  if (session === null) return "";
  const row = history.at(session.position);
  const lines = session.readings
    .filter((reading) => row !== undefined && reading.kind !== "time" && isMeasured(reading, row, session, history))
    .map((reading) => `${reading.title} ${words(reading, row, session)}`);
  const [verdict] = state(history, session);
  return `${[`Frame ${session.position} of ${session.frames}`, verdict, ...lines].filter(Boolean).join("; ")}.`;
}

/**
 * An element that says so as soon as the run stands, and nothing while it moves.
 *
 * @param {import("./mount.js").Mounted} view
 * @param {(sentence: string) => void} [tell] Called with what it says.
 */
export function spokenFrame({ store, signal }, tell = () => {}) {
  const element = h("p", { class: "visually-hidden", role: "status", data: { role: "in-words" } });
  let unsettle = () => {};
  const say = () => {
    unsettle();
    if (store.session === null || store.session.playing) return;
    unsettle = later(() => {
      const sentence = frameInWords(store);
      setText(element, sentence);
      tell(sentence);
    }, SETTLED_MS, signal);
  };
  store.on(["position", "playing", "branch", "history"], say);
  say();
  return element;
}
