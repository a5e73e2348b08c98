/**
 * The keyboard, one table. The keys work in the page, and in the scene's frame, which hands them on (`spatial_scene.js`).
 */

import { dialogIsOpen } from "../shared/dialog.js";

/**
 * @typedef {object} Actions
 * @property {() => void} toggle
 * @property {(direction: number) => void} step
 * @property {(frames: number) => void} jump
 * @property {() => void} first
 * @property {() => void} newest
 * @property {() => void} beforeLoss
 * @property {(direction: number) => void} event
 * @property {() => void} bookmark
 * @property {() => void} branch
 * @property {() => void} inspect
 * @property {() => void} why
 * @property {() => void} compare
 * @property {() => void} difference
 * @property {(direction: number) => void} faster
 * @property {() => void} presets
 * @property {() => void} truth
 * @property {() => void} help
 * @property {() => void} present
 */

/**
 * The sessions that listen in this page.
 *
 * @type {Set<HTMLElement>}
 */
const listening = new Set();

/** @type {[keys: string, what: string][]} What the help shows. */
export const HELP = [
  ["space", "Play or pause"],
  ["← →", "One frame back or forward"],
  ["shift ← →", "Ten frames back or forward"],
  ["home end", "First frame, newest frame"],
  ["L", "Go to before the loss"],
  ["E", "Go to the next event, such as an identity switch; with shift, to the one before"],
  ["W", "Why was it lost?"],
  ["B", "Bookmark this frame"],
  ["N", "Branch from this frame; in a lecture, the next item"],
  ["I", "Look into the frame: likelihood, particles, ancestors; again to stop"],
  ["C", "Compare this run with others"],
  ["[ ]", "Slower, faster"],
  ["P", "List the presets"],
  ["T", "On a recording: mark where the target truly is"],
  ["+ - 0", "In the plots: zoom in at this frame, zoom out, show all; also Ctrl with the wheel"],
  ["F", "Present in large type; escape ends it"],
  ["pageup pagedown", "In a lecture: the item before, the next one"],
  ["?", "This help"],
];

/** @type {Readonly<Record<string, "present"|"bookmark"|"branch"|"inspect"|"compare"|"difference"|"beforeLoss"|"presets"|"truth"|"why">>} */
const LETTERS = {
  b: "bookmark",
  c: "compare",
  d: "difference",
  f: "present",
  i: "inspect",
  l: "beforeLoss",
  n: "branch",
  p: "presets",
  t: "truth",
  w: "why",
};

/**
 * What moves through a run.
 *
 * @param {Pick<import("./mount.js").View, "steering">} view
 */
export function moves(view) {
  return {
    toggle: () => view.steering.toggle(),
    step: (/** @type {number} */ direction) => view.steering.step(direction),
    jump: (/** @type {number} */ frames) => view.steering.jump(frames),
    first: () => view.steering.first(),
    newest: () => view.steering.newest(),
    faster: (/** @type {number} */ direction) => view.steering.faster(direction),
    beforeLoss: () => view.steering.beforeLoss(),
    event: (/** @type {number} */ direction) => view.steering.event(direction),
  };
}

/**
 * Listen to the keys for a session. Where there are several in a page, each has those that are pressed within it; where
 * it is alone, all are its own.
 *
 * @param {HTMLElement} element What holds the session.
 * @param {Partial<Actions>} actions
 * @param {AbortSignal} signal Ends the listening.
 */
export function listen(element, actions, signal) {
  listening.add(element);
  signal.addEventListener("abort", () => listening.delete(element));
  // One that is inert, as while a lesson's question waits for an answer, has none.
  const isMine = (/** @type {EventTarget|null} */ target) =>
    element.closest("[inert]") === null && (listening.size === 1 || (target instanceof Node && element.contains(target)));
  const press = (/** @type {string} */ key, /** @type {boolean} */ shiftKey) => {
    const action = find(actions, key, shiftKey);
    if (!action || dialogIsOpen()) return false;
    action();
    return true;
  };
  document.addEventListener("keydown", (event) => {
    if (!isMine(event.target) || event.ctrlKey || event.metaKey || event.altKey || event.defaultPrevented || takesKeys(event.target, event.key)) return;
    if (press(event.key, event.shiftKey)) event.preventDefault();
  }, { signal });
  // Who clicks in the page has left the scene's text boxes, even if what was clicked takes no focus.
  document.addEventListener("pointerdown", () => {
    if (document.activeElement instanceof HTMLIFrameElement) document.activeElement.blur();
  }, { signal });
}

/**
 * @param {Partial<Actions>} actions
 * @param {string} key
 * @param {boolean} shiftKey
 * @returns {(() => void)|undefined}
 */
function find(actions, key, shiftKey) {
  switch (key) {
    case " ":
      return actions.toggle;
    case "ArrowLeft":
      return () => (shiftKey ? actions.jump?.(-10) : actions.step?.(-1));
    case "ArrowRight":
      return () => (shiftKey ? actions.jump?.(10) : actions.step?.(1));
    case "Home":
      return actions.first;
    case "End":
      return actions.newest;
    case "[":
      return () => actions.faster?.(-1);
    case "]":
      return () => actions.faster?.(1);
    case "?":
      return actions.help;
    default:
      break;
  }
  const letter = key.toLowerCase();
  if (letter === "e") return () => actions.event?.(shiftKey ? -1 : 1);
  return LETTERS[letter] === undefined ? undefined : actions[LETTERS[letter]];
}

/**
 * Whether the element that has the focus needs this key itself.
 *
 * @param {EventTarget|null} target
 * @param {string} key
 */
function takesKeys(target, key) {
  if (!(target instanceof Element)) return false;
  // A slider moves by arrows and the like; everything else goes to the run.
  if (target.closest("input[type=range]")) return /^(Arrow|Home|End|Page)/.test(key);
  if (target.closest("input:not([type=checkbox]):not([type=radio]), textarea, select, [contenteditable]")) return true;
  return (key === " " || key === "Enter") && target.closest("button, a, summary") !== null;
}
