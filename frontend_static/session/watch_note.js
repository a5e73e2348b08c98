/** What to look at, where the run began as a preset that says so: a sentence over the scene, until it is put away. */

import { h, setText } from "../shared/dom.js";
import { icon } from "../shared/icons.js";

/**
 * @param {import("./mount.js").Mounted} view
 * @returns {HTMLElement} Hidden where there is nothing to say, and once it was put away.
 */
export function watchNote({ store }) {
  const words = h("p", {});
  let isAway = false;
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
  draw();
  return element;
}
