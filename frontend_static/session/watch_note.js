/**
 * What to look at, where the run began as a preset that says so: a sentence below the picture, until it is put away, or
 * the run has gone on for a while.
 */

import { h, setText } from "../shared/dom.js";
import { icon } from "../shared/icons.js";

/** So long of the run it stays once that plays, s. */
const STAYS_S = 5;

/**
 * @param {import("./mount.js").Mounted} view
 * @returns {HTMLElement} Hidden where there is nothing to say, and once it was put away.
 */
export function watchNote({ store }) {
  const words = h("p", {});
  let isAway = false;
  /** @type {number|null} The frame from which it has been played. */
  let from = null;
  const putAway = () => {
    isAway = true;
    element.hidden = true;
  };
  const close = h("button", { type: "button", class: "quiet icon-only", title: "Put away", "aria-label": "Put away", on: { click: putAway } }, icon("close"));
  const element = h("aside", { class: "look-at", "aria-label": "What to look at", hidden: true }, words, close);
  const draw = () => {
    const watch = store.session?.watch ?? "";
    setText(words, watch);
    element.hidden = isAway || watch === "";
  };
  store.on(["session"], draw);
  store.on(["position", "playing"], () => {
    const { session } = store;
    if (session === null || isAway) return;
    // Who only goes through the frames by hand still reads it.
    if (session.playing) from ??= session.position;
    if (from !== null && session.position > from + STAYS_S * session.frame_rate_hz) putAway();
  });
  draw();
  return element;
}
