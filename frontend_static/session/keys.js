/** The keyboard, one table. The keys work in the page, and in the scene's frame, which hands them on (`spatial_scene.js`). */

import { dialogIsOpen } from "../shared/dialog.js";

/** @typedef {keyof Actions|((actions: Partial<Actions>, isShifted: boolean) => void)} Act */
/** @typedef {{keys: string, what: string, acts?: Record<string, Act>}} Line What the help shows, and what is done. */

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
 * @property {(factor: number|null) => void} zoom Of the plots: above 1 to see more frames; null for all.
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

/** @type {Line[]} */
export const HELP = [
  { keys: "space", what: "Play or pause", acts: { " ": "toggle" } },
  {
    keys: "← →",
    what: "One frame back or forward",
    acts: { ArrowLeft: (on, isFar) => (isFar ? on.jump?.(-10) : on.step?.(-1)), ArrowRight: (on, isFar) => (isFar ? on.jump?.(10) : on.step?.(1)) },
  },
  { keys: "shift ← →", what: "Ten frames back or forward" },
  { keys: "home end", what: "First frame, newest frame", acts: { Home: "first", End: "newest" } },
  { keys: "L", what: "Go to before the loss", acts: { l: "beforeLoss" } },
  {
    keys: "E",
    what: "Go to the next event, such as an identity switch; with shift, to the one before",
    acts: { e: (on, isBack) => on.event?.(isBack ? -1 : 1) },
  },
  { keys: "W", what: "Why was it lost?", acts: { w: "why" } },
  { keys: "B", what: "Bookmark this frame", acts: { b: "bookmark" } },
  { keys: "N", what: "Branch from this frame; in a lecture, the next item", acts: { n: "branch" } },
  { keys: "I", what: "Look into the frame: likelihood, particles, ancestors; again to stop", acts: { i: "inspect" } },
  { keys: "C", what: "Compare this run with others", acts: { c: "compare", d: "difference" } },
  { keys: "[ ]", what: "Slower, faster", acts: { "[": (on) => on.faster?.(-1), "]": (on) => on.faster?.(1) } },
  { keys: "P", what: "List the presets", acts: { p: "presets" } },
  { keys: "T", what: "On a recording: mark where the target truly is", acts: { t: "truth" } },
  {
    keys: "+ - 0",
    what: "In the plots: zoom in at this frame, zoom out, show all; also Ctrl with the wheel",
    acts: { "+": (on) => on.zoom?.(1 / 2), "=": (on) => on.zoom?.(1 / 2), "-": (on) => on.zoom?.(2), 0: (on) => on.zoom?.(null) },
  },
  { keys: "F", what: "Present in large type; escape ends it", acts: { f: "present" } },
  { keys: "pageup pagedown", what: "In a lecture: the item before, the next one" },
  { keys: "F1", what: "What the control does that has the focus" },
  { keys: "Ctrl K", what: "Find anything: commands, parameters, presets, lessons, runs" },
  { keys: "?", what: "This help", acts: { "?": "help" } },
];

/** @type {Record<string, Act>} By what the keyboard calls the key. */
const ACTS = Object.assign({}, ...HELP.map(({ acts }) => acts));

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
 * @param {AbortSignal} end Ends the listening.
 */
export function listen(element, actions, end) {
  listening.add(element);
  end.addEventListener("abort", () => listening.delete(element));
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
  }, { signal: end });
  // A click in the page leaves the scene's text boxes, even where the clicked element takes no focus.
  document.addEventListener("pointerdown", () => {
    if (document.activeElement instanceof HTMLIFrameElement) document.activeElement.blur();
  }, { signal: end });
}

/**
 * @param {Partial<Actions>} actions
 * @param {string} key
 * @param {boolean} shiftKey
 * @returns {(() => void)|undefined}
 */
function find(actions, key, shiftKey) {
  const act = ACTS[key.length === 1 ? key.toLowerCase() : key];
  return typeof act === "function" ? () => act(actions, shiftKey) : /** @type {() => void} */ (actions[act]);
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
