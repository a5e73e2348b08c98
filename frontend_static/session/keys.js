/** The keyboard, one table. The keys work in the page, and in the scene's frame, which passes them on (`spatial_scene.js`). */

import { dialogIsOpen } from "../shared/dialog.js";

/** @import { View } from "./mount.js" */

/** The action of a key: one of the page's actions, or a function of the run's steering.
 *
 * @typedef {Exclude<keyof Actions, "zoom">|((steering: View["steering"], isShifted: boolean, actions: Partial<Actions>) => unknown)} Act
 */
/** @typedef {{keys: string, what: string, acts?: Record<string, Act>}} Line The entry in the help, and the actions. */

/**
 * @typedef {object} Actions
 * @property {() => void} bookmark
 * @property {() => void} branch
 * @property {() => void} inspect
 * @property {() => void} why
 * @property {() => void} compare
 * @property {() => void} difference
 * @property {(factor: number|null) => void} zoom Zooms the plots: above 1 to see more frames; null for all.
 * @property {() => void} presets
 * @property {() => void} truth
 * @property {() => void} help
 * @property {() => void} present
 */

/** The sessions of this page that handle keys.
 *
 * @type {Set<HTMLElement>}
 */
const listening = new Set();

/** @type {Line[]} */
export const HELP = [
  { keys: "space", what: "Play or pause", acts: { " ": (steering) => steering.toggle() } },
  {
    keys: "← →",
    what: "One frame back or forward",
    acts: {
      ArrowLeft: (steering, isFar) => (isFar ? steering.jump(-10) : steering.step(-1)),
      ArrowRight: (steering, isFar) => (isFar ? steering.jump(10) : steering.step(1)),
    },
  },
  { keys: "shift ← →", what: "Ten frames back or forward" },
  { keys: "home end", what: "First frame, newest frame", acts: { Home: (steering) => steering.seek(0), End: (steering) => steering.newest() } },
  { keys: "L", what: "Go to before the loss", acts: { l: (steering) => steering.beforeLoss() } },
  {
    keys: "E",
    what: "Go to the next event, such as an identity switch; with shift, to the previous one",
    acts: { e: (steering, isBack) => steering.event(isBack ? -1 : 1) },
  },
  { keys: "W", what: "Why was it lost?", acts: { w: "why" } },
  { keys: "B", what: "Bookmark this frame", acts: { b: "bookmark" } },
  { keys: "N", what: "Branch from this frame; in a lecture, the next item", acts: { n: "branch" } },
  { keys: "I", what: "Inspect the frame: likelihood, particles, ancestors; again to stop", acts: { i: "inspect" } },
  { keys: "C", what: "Compare this run with others", acts: { c: "compare", d: "difference" } },
  { keys: "[ ]", what: "Slower, faster", acts: { "[": (steering) => steering.faster(-1), "]": (steering) => steering.faster(1) } },
  { keys: "P", what: "List the presets", acts: { p: "presets" } },
  { keys: "T", what: "On a recording: mark the true target", acts: { t: "truth" } },
  {
    keys: "+ - 0",
    what: "In the plots: zoom in at this frame, zoom out, show all; also Ctrl with the wheel",
    acts: { "+": zoomBy(1 / 2), "=": zoomBy(1 / 2), "-": zoomBy(2), 0: zoomBy(null) },
  },
  { keys: "F", what: "Present in large type; escape ends it", acts: { f: "present" } },
  { keys: "pageup pagedown", what: "In a lecture: previous and next item" },
  { keys: "F1", what: "Explain the focused control" },
  { keys: "Ctrl K", what: "Find anything: commands, parameters, presets, lessons, runs" },
  { keys: "?", what: "This help", acts: { "?": "help" } },
];

/** @type {Record<string, Act>} Actions by the keyboard's name of the key. */
const ACTS = Object.assign({}, ...HELP.map(({ acts }) => acts));

/**
 * @param {number|null} factor
 * @returns {Act}
 */
function zoomBy(factor) {
  return (_steering, _isShifted, { zoom }) => zoom?.(factor);
}

/** Handle the keys of a session. With several on a page, each handles keys pressed within it; a single one handles all.
 *
 * @param {HTMLElement} element Element of the session.
 * @param {Pick<View, "steering"|"signal">} view Its end ends the listening.
 * @param {Partial<Actions>} actions
 */
export function listen(element, view, actions) {
  const { signal } = view;
  listening.add(element);
  signal.addEventListener("abort", () => listening.delete(element));
  // An inert session, as while a lesson's question waits for an answer, handles none.
  const isMine = (/** @type {EventTarget|null} */ target) =>
    element.closest("[inert]") === null && (listening.size === 1 || (target instanceof Node && element.contains(target)));
  document.addEventListener("keydown", (event) => {
    const { key, shiftKey, target } = event;
    if (!isMine(target) || event.ctrlKey || event.metaKey || event.altKey || event.defaultPrevented || takesKeys(target, key)) return;
    const act = ACTS[key.length === 1 ? key.toLowerCase() : key];
    const run = typeof act === "function" ? () => act(view.steering, shiftKey, actions) : actions[act];
    if (!run || dialogIsOpen()) return;
    event.preventDefault();
    run();
  }, { signal });
  // A click in the page leaves the scene's text boxes, even where the clicked element takes no focus.
  document.addEventListener("pointerdown", () => {
    if (document.activeElement instanceof HTMLIFrameElement) document.activeElement.blur();
  }, { signal });
}

/** Whether the focused element needs this key itself.
 *
 * @param {EventTarget|null} target
 * @param {string} key
 */
function takesKeys(target, key) {
  if (!(target instanceof Element)) return false;
  // A slider needs arrows and similar keys; all others go to the run.
  if (target.closest("input[type=range]")) return /^(Arrow|Home|End|Page)/.test(key);
  if (target.closest("input:not([type=checkbox]):not([type=radio]), textarea, select, [contenteditable]")) return true;
  return (key === " " || key === "Enter") && target.closest("button, a, summary") !== null;
}
