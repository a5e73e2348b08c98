/**
 * Presentation: the page fills the screen in large type, to be read from the back of a lecture room. Sizes follow the font
 * size of the root; what gives way to the picture is said by the style sheets under `data-presenting`. It belongs to the tab:
 * whoever goes on to another page goes on presenting, until it is ended. Pages without its button are shown as ever meanwhile.
 */

import { dialogIsOpen } from "./dialog.js";
import { fill, h } from "./dom.js";
import { icon } from "./icons.js";

const KEY = "f";
const KEPT_AS = "pftrack-presenting";
const TYPED = "input:not([type=checkbox]):not([type=radio]):not([type=range]), textarea, select, [contenteditable]";
const root = document.documentElement;
/** The browser leaves full screen by itself with the page; that ends nothing. */
let isLeft = false;

addEventListener("pagehide", () => (isLeft = true));
addEventListener("pageshow", () => (isLeft = false));
// The browser ends full screen by itself when somebody presses Escape.
document.addEventListener("fullscreenchange", () => document.fullscreenElement === null && !isLeft && turn(false));
document.addEventListener("keydown", (event) => {
  if (event.key !== "Escape" || !isPlain(event) || document.querySelector(":popover-open") !== null) return;
  if (isPresenting() || isKept()) present(false);
});

/** Whether the page is presented. */
export function isPresenting() {
  return root.dataset.presenting !== undefined;
}

/**
 * The button that begins and ends it, as the key F does; Escape ends it, too.
 *
 * @param {{hears?: boolean}} [options] Whether it listens to the key F itself; a session's page has a table of keys.
 */
export function presentationButton({ hears = true } = {}) {
  const button = h("button", { type: "button", class: "quiet icon-only", data: { role: "present" }, on: { click: () => present() } });
  const show = () => {
    const title = isPresenting() ? "Leave the presentation (F or escape)" : "Present in large type (F)";
    fill(button, icon(isPresenting() ? "shrink" : "enlarge"));
    button.title = title;
    button.setAttribute("aria-label", title);
    button.setAttribute("aria-pressed", String(isPresenting()));
  };
  new MutationObserver(show).observe(root, { attributeFilter: ["data-presenting"] });
  document.addEventListener("keydown", (event) => {
    if (hears && event.key.toLowerCase() === KEY && isPlain(event) && !isTyping(event.target)) present();
  });
  if (isKept()) goOn();
  show();
  return button;
}

/**
 * Begin or end it; full screen is asked for and done without.
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
    // Not allowed here, as within a frame: large type in the window does as well.
  }
}

/** Have the page that is opened next be presented. */
export function presentNext() {
  keep(true);
}

/** Present as the page before did. Browsers give a new page the whole screen only after a key or a click. */
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
  if (wanted) root.dataset.presenting = "";
  else delete root.dataset.presenting;
  keep(wanted);
}

/** @param {boolean} wanted */
function keep(wanted) {
  try {
    if (wanted) sessionStorage.setItem(KEPT_AS, "");
    else sessionStorage.removeItem(KEPT_AS);
  } catch {
    // Without storage it ends with the page.
  }
}

/** Whether the tab presents, be it shown on this page or not. */
function isKept() {
  try {
    return sessionStorage.getItem(KEPT_AS) !== null;
  } catch {
    return false;
  }
}

/**
 * Whether a key is meant for the page as it stands.
 *
 * @param {KeyboardEvent} event
 */
function isPlain(event) {
  return !event.defaultPrevented && !event.ctrlKey && !event.metaKey && !event.altKey && !dialogIsOpen();
}

/** @param {EventTarget|null} target */
function isTyping(target) {
  return target instanceof Element && target.closest(TYPED) !== null;
}
