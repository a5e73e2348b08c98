/**
 * Colours of maps. Viridis for amounts, a diverging map with a neutral middle for differences, and four colours for the
 * outcome of a test. Whoever cannot tell red from green reads all of them.
 */

import { isDark } from "../shared/theme.js";

const VIRIDIS = [
  [68, 1, 84], [72, 26, 108], [71, 47, 125], [65, 68, 135], [57, 86, 140], [49, 104, 142], [42, 120, 142], [35, 136, 142],
  [31, 152, 139], [34, 168, 132], [53, 183, 121], [84, 197, 104], [122, 209, 81], [165, 219, 54], [210, 226, 27], [253, 231, 37],
];
/** The first of two methods is blue, the second orange (Okabe and Ito), as in the figures of a report. */
const FIRST = [[244, 244, 244], [128, 184, 216], [0, 114, 178], [0, 50, 79]];
const SECOND = [[244, 244, 244], [243, 207, 128], [230, 159, 0], [107, 61, 0]];
/** On a dark page the middle is dark, and the arms grow lighter. */
const DARK_FIRST = [[52, 56, 64], [24, 86, 128], [60, 150, 210], [150, 205, 240]];
const DARK_SECOND = [[52, 56, 64], [112, 80, 16], [214, 150, 20], [253, 210, 110]];

/** What a test says of a cell, by the code that the server sends. */
export const VERDICTS = {
  first: { light: [0, 114, 178], dark: [86, 160, 215], sign: "1" },
  second: { light: [230, 159, 0], dark: [230, 159, 0], sign: "2" },
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
