/**
 * Presentation: the page fills the screen in large type, to be read from the back of a lecture room. Sizes follow the font
 * size of the root; what gives way to the picture is said by the style sheets under `data-presenting`.
 */

import { dialogIsOpen } from "./dialog.js";
import { fill, h } from "./dom.js";
import { icon } from "./icons.js";

const KEY = "f";
const TYPED = "input:not([type=checkbox]):not([type=radio]):not([type=range]), textarea, select, [contenteditable]";
const root = document.documentElement;

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
  // The browser ends full screen by itself when somebody presses Escape.
  document.addEventListener("fullscreenchange", () => document.fullscreenElement === null && turn(false));
  document.addEventListener("keydown", (event) => {
    if (event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey || dialogIsOpen()) return;
    if (event.key === "Escape" && isPresenting() && document.querySelector(":popover-open") === null) present(false);
    else if (hears && event.key.toLowerCase() === KEY && !isTyping(event.target)) present();
  });
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

/** @param {boolean} wanted */
function turn(wanted) {
  if (wanted) root.dataset.presenting = "";
  else delete root.dataset.presenting;
}

/** @param {EventTarget|null} target */
function isTyping(target) {
  return target instanceof Element && target.closest(TYPED) !== null;
}
