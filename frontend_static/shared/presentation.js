/** Presentation: the page fills the screen in large type, readable from the back of a lecture room. Sizes follow the font size of the root;
 * the style sheets hide other things under `data-presenting`. It belongs to the tab: the next page presents, too, until it is ended. Pages
 without its button look as usual. */

import { effect, h, signal, useLayoutEffect } from "../vendor/preact.js";
import { dialogIsOpen } from "./dialog.js";
import { IconButton } from "./dom.js";
import { keptInTab } from "./visitor.js";

// Printing: a page as a handout, by the rules of `print.css`. Pictures that only the server can draw for printing, such as that of a 3-D
// scene, are fetched before the browser prints; printing from its menu uses the last ones.

/** @type {Set<() => Promise<unknown>>} What is done before the page is printed. */
const preparing = new Set();

/**
 * Call `prepare` before the page is printed.
 *
 * @param {() => Promise<unknown>} prepare
 * @param {AbortSignal} end Until then.
 */
export function beforePrinting(prepare, end) {
  preparing.add(prepare);
  end.addEventListener("abort", () => preparing.delete(prepare));
}

/** Prints the page; control and P do the same. */
export function PrintButton() {
  useLayoutEffect(() => document.addEventListener("keydown", (event) => {
    if (event.key.toLowerCase() !== "p" || !(event.ctrlKey || event.metaKey) || event.altKey || event.shiftKey) return;
    event.preventDefault();
    printPage();
  }), []);
  return h(IconButton, { name: "print", title: "Print as a handout", run: printPage, "data-role": "print" });
}

async function printPage() {
  await Promise.allSettled([...preparing].map((prepare) => prepare()));
  globalThis.print();
}

const PRESENTED_KEY = "f";
const TYPED = "input:not([type=checkbox]):not([type=radio]):not([type=range]), textarea, select, [contenteditable]";
const root = document.documentElement;
const presenting = signal(false);
/** Whether the tab presents, visible on this page or not. */
const kept = /** @type {import("./visitor.js").KeptInTab<boolean>} */ (keptInTab("pftrack-presenting"));
/** The browser leaves full screen with the page; that does not end the presentation. */
let isLeft = false;

effect(() => {
  if (presenting.value) root.dataset.presenting = "";
  else delete root.dataset.presenting;
});
addEventListener("pagehide", () => (isLeft = true));
addEventListener("pageshow", () => (isLeft = false));
// The browser itself ends full screen on Escape.
document.addEventListener("fullscreenchange", () => document.fullscreenElement === null && !isLeft && turn(false));
document.addEventListener("keydown", (event) => {
  if (event.key !== "Escape" || !isPlain(event) || document.querySelector(":popover-open") !== null) return;
  if (isPresenting() || kept.get()) present(false);
});

/** Whether the page is presented; components and effects that read it follow it as a signal. */
export function isPresenting() {
  return presenting.value;
}

/** The button that begins and ends the presentation, as the key F does; Escape ends it, too.
 *
 * @param {{hears?: boolean}} props Whether it handles the key F itself; a session's page has a table of keys.
 */
export function PresentationButton({ hears = true }) {
  useLayoutEffect(() => {
    document.addEventListener("keydown", (event) => {
      if (hears && event.key.toLowerCase() === PRESENTED_KEY && isPlain(event) && !isTyping(event.target)) present();
    });
    if (kept.get()) goOn();
  }, []);
  const isOn = presenting.value;
  const title = isOn ? "Leave the presentation (F or escape)" : "Present in large type (F)";
  return h(IconButton, { name: isOn ? "shrink" : "enlarge", title, run: () => present(), "aria-pressed": String(isOn), "data-role": "present" });
}

/** Begin or end the presentation; full screen is requested, but not necessary.
 *
 * @param {boolean} [wanted]
 */
export async function present(wanted = !isPresenting()) {
  turn(wanted);
  try {
    if (wanted && document.fullscreenElement === null) {
      await root.requestFullscreen();
      if (!isPresenting()) await document.exitFullscreen(); // left before the browser was there
    } else if (!wanted && document.fullscreenElement !== null) await document.exitFullscreen();
  } catch {
    // Not allowed here, as within an iframe: large type in the window is enough.
  }
}

/** Present the next opened page. */
export function presentNext() {
  kept.set(true);
}

/** Continue the previous page's presentation. Browsers give a new page the whole screen only after a key or a click. */
function goOn() {
  turn(true);
  const heard = new AbortController();
  const again = () => {
    heard.abort();
    if (isPresenting()) present(true);
  };
  document.addEventListener("pointerup", again, { signal: heard.signal });
  document.addEventListener("keydown", (event) => isPlain(event) && again(), { signal: heard.signal });
}

/** @param {boolean} wanted */
function turn(wanted) {
  presenting.value = wanted;
  kept.set(wanted || null);
}

/**
 * Whether a key is meant for the page itself, and not for the browser or a dialog.
 *
 * @param {KeyboardEvent} event
 */
export function isPlain(event) {
  return !event.defaultPrevented && !event.ctrlKey && !event.metaKey && !event.altKey && !dialogIsOpen();
}

/**
 * Whether a letter belongs to a field in which a person types or chooses.
 *
 * @param {EventTarget|null} target
 */
export function isTyping(target) {
  return target instanceof Element && target.closest(TYPED) !== null;
}
