/** The keys of a lesson's page. Where a run is shown, the keys are the session's. */

import { dialogIsOpen, openDialog } from "../shared/dialog.js";
import { h, part } from "../shared/dom.js";

const KEYS = [
  ["N", "Next lesson"],
  ["P", "Previous lesson"],
  ["D", "New draw"],
  ["F", "Present in large type; escape ends it"],
  ["pageup pagedown", "In a lecture: the item before, the next one"],
  ["?", "These keys"],
];
const ARROWS = "A slider, or a line in the figure, that has the focus is moved by the arrow keys. Where a run is shown, the keys are those of a session.";
const TYPING = "input:not([type=range], [type=radio], [type=checkbox]), textarea, select";

/**
 * @param {() => void} draw
 * @param {AbortSignal} signal
 */
export function listen(draw, signal) {
  /** @type {Record<string, () => void>} */
  const actions = { n: () => go("next"), p: () => go("prev"), d: draw, "?": help };
  document.addEventListener("keydown", (event) => {
    const isTyping = event.target instanceof Element && event.target.closest(TYPING) !== null;
    if (isTyping || event.ctrlKey || event.metaKey || event.altKey || event.defaultPrevented || dialogIsOpen()) return;
    if (document.querySelector(".session-view") === null) actions[event.key.toLowerCase()]?.();
  }, { signal });
}

/** Tell which keys there are. */
export function help() {
  openDialog("Keys", () => [
    h("dl", { class: "keys" }, KEYS.map(([keys, what]) => [h("dt", {}, keys.split(" ").map((key) => h("kbd", {}, key))), h("dd", {}, what)])),
    h("p", { class: "hint" }, ARROWS),
  ]);
}

/** @param {"next"|"prev"} rel Which neighbour's link to take. */
function go(rel) {
  part("neighbours").querySelector(`a[rel=${rel}]`)?.dispatchEvent(new MouseEvent("click", { bubbles: true, cancelable: true }));
}
