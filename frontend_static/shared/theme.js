/** Light and dark: by the system, unless a person said otherwise. The choice is applied early, by `apply_theme.js`. */

import { fill, h } from "./dom.js";
import { icon } from "./icons.js";
import { remember } from "./memory.js";
import { signal } from "../vendor/preact.js";

const KEY = "pftrack-theme";
/** @typedef {"auto"|"light"|"dark"} Theme */

/** @type {Record<Theme, Theme>} */
const NEXT = { auto: "light", light: "dark", dark: "auto" };
/** @type {Record<Theme, import("./icons.js").IconName>} */
const LOOK = { auto: "auto", light: "sun", dark: "moon" };
const WORDS = { auto: "as the system", light: "light", dark: "dark" };

/** Told to the document when a person has chosen other colours. */
const CHANGED = "pftrack-theme";

const system = () => matchMedia("(prefers-color-scheme: dark)");
const paper = () => matchMedia("print");

/** @returns {Theme} */
function chosen() {
  const { theme } = document.documentElement.dataset;
  return theme === "light" || theme === "dark" ? theme : "auto";
}

/** Whether the page is dark now; paper is not. */
export function isDark() {
  if (paper().matches) return false;
  return chosen() === "auto" ? system().matches : chosen() === "dark";
}

/**
 * Call `listener` whenever the colours changed. Printing changes them as well, and the sizes: the browser tells it once the
 * page is laid out for paper, and observes no sizes and shows no frames until it is printed, so that a canvas has to be
 * painted within `listener` to be right there.
 *
 * @param {() => void} listener
 * @param {AbortSignal} [end] Until then.
 */
export function onTheme(listener, end) {
  for (const query of [system(), paper()]) query.addEventListener("change", listener, { signal: end });
  document.addEventListener(CHANGED, listener, { signal: end });
}

/** Counts the changes, for components. */
const changes = signal(0);

/** Which colours are chosen, in words. */
export function themeWords() {
  void changes.value;
  return WORDS[chosen()];
}

/** Go round light, dark and the system's choice. */
export function changeTheme() {
  const next = NEXT[chosen()];
  if (next === "auto") delete document.documentElement.dataset.theme;
  else document.documentElement.dataset.theme = next;
  remember(KEY, next);
  changes.value += 1;
  document.dispatchEvent(new Event(CHANGED));
}

/** The button that does so. */
export function themeButton() {
  const button = h("button", { class: "quiet icon-only", type: "button", "data-role": "theme", on: { click: changeTheme } });
  const show = () => {
    fill(button, icon(LOOK[chosen()]));
    button.title = `Colours ${themeWords()}`;
    button.setAttribute("aria-label", `Colours ${themeWords()}; change`);
  };
  document.addEventListener(CHANGED, show);
  show();
  return button;
}

/**
 * The values of colour tokens as they are now, for canvases, which cannot read style sheets.
 *
 * @param {...string} names
 */
export function tokens(...names) {
  const probe = h("span", { hidden: true });
  document.body.append(probe);
  /** @type {Record<string, string>} */
  const found = {};
  for (const name of names) {
    probe.style.color = `var(--${name})`;
    found[name] = getComputedStyle(probe).color;
  }
  probe.remove();
  return found;
}
