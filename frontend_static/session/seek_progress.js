/**
 * What a run is busy with that takes a while: many frames on its way somewhere, to where a session was or to a frame that
 * was asked for, with the button that stops it; or compiling what it uses for the first time.
 */

import { h, setText } from "../shared/dom.js";
import { progressWords } from "../shared/progress.js";
import { later } from "../shared/timing.js";

/** What takes no longer than this is over before anybody could read of it. */
const SHOWN_AFTER_MS = 500;
/** A goal that is no frame. */
const COMPILED = Infinity;

/**
 * @param {import("./mount.js").Mounted} view
 * @returns {HTMLElement} Hidden while the run is not on its way.
 */
export function seekProgress({ store, commands, signal }) {
  const words = h("p", { role: "status" });
  const meter = h("progress", { max: 1, value: 0, "aria-label": "How far it is" });
  const stop = h("button", { type: "button", title: "Stop at the current frame", on: { click: () => commands.stop() } }, "Stop here");
  const element = h("div", { class: "on-the-way", hidden: true }, words, meter, stop);
  /** @type {{goal: number, frame: number, at: number}|null} */
  let begun = null;
  let forget = () => {};

  const draw = () => {
    const { session } = store;
    const compiled = session?.compiling ?? null;
    const goal = compiled === null ? (session?.goal ?? null) : COMPILED;
    if (session === null || goal === null || store.connection !== "open" || !store.isAwake) {
      begun = null;
      forget();
      element.hidden = true;
      return;
    }
    if (begun?.goal !== goal) {
      begun = { goal, frame: session.position, at: performance.now() };
      forget();
      forget = later(() => (element.hidden = begun === null), SHOWN_AFTER_MS, signal);
    }
    stop.hidden = goal === COMPILED || store.isReadOnly;
    if (compiled !== null) {
      meter.removeAttribute("value");
      setText(words, `Compiling what is used for the first time, ${compiled} ${compiled === 1 ? "function" : "functions"} so far`);
      return;
    }
    meter.value = goal > 0 ? session.position / goal : 1;
    setText(words, progressWords(session.position, goal, (performance.now() - begun.at) / 1000, session.position - begun.frame));
  };
  store.on(["position", "goal", "compiling", "state", "connection"], draw);
  return element;
}
