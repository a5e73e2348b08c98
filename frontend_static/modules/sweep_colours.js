/**
 * Colours of maps. Viridis for amounts, a diverging map with a neutral middle for differences, and four colours for the
 * outcome of a test. Whoever cannot tell red from green reads all of them.
 */

import { isDark } from "./theme.js";

const VIRIDIS = [
  [68, 1, 84], [72, 26, 108], [71, 47, 125], [65, 68, 135], [57, 86, 140], [49, 104, 142], [42, 120, 142], [35, 136, 142],
  [31, 152, 139], [34, 168, 132], [53, 183, 121], [84, 197, 104], [122, 209, 81], [165, 219, 54], [210, 226, 27], [253, 231, 37],
];
/** The first of two methods is purple, the second orange, as in ColorBrewer's PuOr. */
const FIRST = [[242, 240, 244], [178, 171, 210], [128, 115, 172], [84, 39, 136]];
const SECOND = [[242, 240, 244], [253, 184, 99], [224, 130, 20], [179, 88, 6]];
/** On a dark page the middle is dark, and the arms grow lighter. */
const DARK_FIRST = [[52, 56, 64], [92, 82, 132], [140, 122, 196], [196, 180, 240]];
const DARK_SECOND = [[52, 56, 64], [132, 86, 34], [214, 130, 34], [253, 196, 120]];

/** What a test says of a cell, by the code that the server sends. */
export const VERDICTS = {
  first: { light: [128, 115, 172], dark: [150, 137, 196], sign: "1" },
  second: { light: [224, 130, 20], dark: [224, 130, 20], sign: "2" },
  none: { light: [200, 204, 209], dark: [92, 99, 109], sign: "=" },
  untested: { light: [255, 255, 255], dark: [27, 30, 35], sign: "·" },
};

/** @param {number} share 0..1 */
export function viridis(share) {
  return ramp(VIRIDIS, share);
}

/** @param {number} share -1..1; above 0 the first method is ahead. */
export function diverging(share) {
  const [first, second] = isDark() ? [DARK_FIRST, DARK_SECOND] : [FIRST, SECOND];
  return ramp(share >= 0 ? first : second, Math.abs(share));
}

/** @param {keyof VERDICTS} verdict */
export function verdict(verdict) {
  return VERDICTS[verdict][isDark() ? "dark" : "light"];
}

/** Black or white, whichever is read more easily on a colour. */
export function inkOn([red, green, blue]) {
  const [r, g, b] = [red, green, blue].map((value) => (value / 255) ** 2.2);
  return 0.2126 * r + 0.7152 * g + 0.0722 * b > 0.2 ? "#000" : "#fff";
}

export function css([red, green, blue]) {
  return `rgb(${red} ${green} ${blue})`;
}

/** A strip of colours from 0 to 1 (or -1 to 1), as a background. */
export function gradient(colour, from = 0) {
  const stops = Array.from({ length: 17 }, (_, index) => css(colour(from + ((1 - from) * index) / 16)));
  return `linear-gradient(90deg, ${stops.join(", ")})`;
}

function ramp(stops, share) {
  const place = Math.min(Math.max(share, 0), 1) * (stops.length - 1);
  const index = Math.min(Math.floor(place), stops.length - 2);
  const weight = place - index;
  return stops[index].map((value, channel) => Math.round(value + weight * (stops[index + 1][channel] - value)));
}
