/** Colours, and light and dark: by the system, unless a person said otherwise. The choice is applied early, by `apply_theme.js`. */

import { h, signal } from "../vendor/preact.js";
import { build, IconButton } from "./dom.js";
import { DIVERGING, VERDICTS, VIRIDIS } from "./palette.js";
import { remember } from "./visitor.js";

const KEY = "pftrack-theme";
/** @typedef {"auto"|"light"|"dark"} Theme */

/** @type {Record<Theme, Theme>} */
const NEXT = { auto: "light", light: "dark", dark: "auto" };
/** @type {Record<Theme, import("./dom.js").IconName>} */
const LOOK = { auto: "auto", light: "sun", dark: "moon" };
const WORDS = { auto: "as the system", light: "light", dark: "dark" };

/** Event on the document when a person has chosen other colours. */
const CHANGED = "pftrack-theme";

const system = () => matchMedia("(prefers-color-scheme: dark)");
const paper = () => matchMedia("print");

/** @returns {Theme} */
function chosen() {
  const { theme } = document.documentElement.dataset;
  return theme === "light" || theme === "dark" ? theme : "auto";
}

/** Whether the page is dark now; a printed page is not. */
export function isDark() {
  if (paper().matches) return false;
  return chosen() === "auto" ? system().matches : chosen() === "dark";
}

/**
 * Call `listener` whenever the colours changed. Printing changes them as well, and the sizes: the browser reports it once the page is laid
 * out for printing, and observes no sizes and shows no frames until it is printed, so that a canvas has to be painted within `listener` to
 * be right there.
 *
 * @param {() => void} listener
 * @param {AbortSignal} [end] Ends the calls.
 */
export function onTheme(listener, end) {
  for (const query of [system(), paper()]) query.addEventListener("change", listener, { signal: end });
  document.addEventListener(CHANGED, listener, { signal: end });
}

/** Number of changes, for components. */
const changes = signal(0);

/** Which colours are chosen, in words. */
export function themeWords() {
  void changes.value;
  return WORDS[chosen()];
}

/** Switch between light, dark and the system's choice. */
export function changeTheme() {
  const next = NEXT[chosen()];
  if (next === "auto") delete document.documentElement.dataset.theme;
  else document.documentElement.dataset.theme = next;
  remember(KEY, next);
  changes.value += 1;
  document.dispatchEvent(new Event(CHANGED));
}

/** The button that switches. */
export function ThemeButton() {
  const title = `Colours ${themeWords()}`;
  return h(IconButton, { name: LOOK[chosen()], title, run: changeTheme, "aria-label": `${title}; change`, "data-role": "theme" });
}

/** The present values of colour tokens, for canvases, which cannot read style sheets.
 *
 * @param {...string} names
 */
export function tokens(...names) {
  const probe = build("span", { hidden: true });
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

// Colours of maps. Viridis for amounts, a diverging map with a neutral middle for differences, and four colours for the
// outcome of a test. All of them are readable for people with red-green colour blindness.

/** @typedef {import("./palette.js").Colour} Colour */

/** Symbols for the outcomes of a test, where words do not fit. */
export const SIGNS = /** @type {const} */ ({ first: "1", second: "2", none: "=", untested: "·" });

/** @param {number} share 0..1 */
export function viridis(share) {
  return ramp(VIRIDIS, share);
}

/** @param {number} share -1..1; above 0 the first method is ahead. */
export function diverging(share) {
  const ground = isDark() ? "dark" : "light";
  return ramp(DIVERGING.map((pair) => pair[ground]), (share + 1) / 2);
}

/**
 * @param {keyof typeof VERDICTS} outcome
 * @returns {Readonly<Colour>}
 */
export function verdict(outcome) {
  return VERDICTS[outcome][isDark() ? "dark" : "light"];
}

/** Black or white, whichever is more readable on a colour.
 *
 * @param {Readonly<Colour>} colour
 */
export function inkOn(colour) {
  const [red, green, blue] = colour.map((value) => (value / 255) ** 2.2);
  return 0.2126 * red + 0.7152 * green + 0.0722 * blue > 0.2 ? "#000" : "#fff";
}

/** @param {ArrayLike<number>} colour RGB, 0 to 255 */
export function css(colour) {
  return `rgb(${colour[0]} ${colour[1]} ${colour[2]})`;
}

/**
 * A strip of colours from 0 to 1 (or -1 to 1), as a background.
 *
 * @param {(share: number) => Colour} colour
 * @param {number} [from]
 */
export function gradient(colour, from = 0) {
  const stops = Array.from({ length: 17 }, (_, index) => css(colour(from + ((1 - from) * index) / 16)));
  return `linear-gradient(90deg, ${stops.join(", ")})`;
}

/**
 * @param {Colour[]} stops In equal steps.
 * @param {number} share 0..1
 * @returns {Colour}
 */
function ramp(stops, share) {
  const place = Math.min(Math.max(share, 0), 1) * (stops.length - 1);
  const index = Math.min(Math.floor(place), stops.length - 2);
  const weight = place - index;
  const [low, high] = [stops[index], stops[index + 1]];
  return /** @type {Colour} */ (low.map((value, channel) => Math.round(value + weight * (high[channel] - value))));
}

// The room that an element gives to a canvas, and the scale of its content.

/** @typedef {{width: number, height: number}} CanvasSize pixels of the display */

/** Font size for which small content on canvases is drawn, px: that of the class `small-print`. */
const SMALL_PX = 11;

/** The scale of content in an element of the class `small-print`, relative to the page's usual font size.
 *
 * @param {Element} element
 */
export function enlargement(element) {
  return parseFloat(getComputedStyle(element).fontSize) / SMALL_PX || 1;
}

/** Call `changed` with an element's room, at once and after each change.
 *
 * @param {HTMLElement} element
 * @param {(room: CanvasSize) => void} changed
 * @param {AbortSignal} end Ends it.
 */
export function watchCanvasSize(element, changed, end) {
  const observer = new ResizeObserver(([{ devicePixelContentBoxSize: sizes, contentRect }]) => {
    const width = sizes?.[0]?.inlineSize ?? Math.round(contentRect.width * devicePixelRatio);
    const height = sizes?.[0]?.blockSize ?? Math.round(contentRect.height * devicePixelRatio);
    changed({ width, height });
  });
  end.addEventListener("abort", () => observer.disconnect());
  try {
    observer.observe(element, { box: "device-pixel-content-box" });
  } catch {
    // Safari knows its pixels only roughly.
    observer.observe(element);
  }
}
