/**
 * Colours of maps. Viridis for amounts, a diverging map with a neutral middle for differences, and four colours for the
 * outcome of a test. All of them can be read without telling red from green.
 */

import { DIVERGING, VERDICTS, VIRIDIS } from "./palette.js";
import { isDark } from "./theme.js";

/** @typedef {import("./palette.js").Colour} Colour */

/** What stands for the outcome of a test where there is no room for words. */
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

/**
 * Black or white, whichever is read more easily on a colour.
 *
 * @param {Readonly<Colour>} colour
 */
export function inkOn(colour) {
  const [red, green, blue] = colour.map((value) => (value / 255) ** 2.2);
  return 0.2126 * red + 0.7152 * green + 0.0722 * blue > 0.2 ? "#000" : "#fff";
}

/** @param {Readonly<Colour>} colour */
export function css([red, green, blue]) {
  return `rgb(${red} ${green} ${blue})`;
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
