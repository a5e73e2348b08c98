// Generated from pftrack/core/model/palette.yaml by `python -m tools.page_palette`; changes here are lost.

/** @typedef {[number, number, number]} Colour Red, green and blue, 0 to 255. */
/** @typedef {{light: Colour, dark: Colour}} Themed */

/** Colours of amounts, in equal steps.
 *
 * @type {Colour[]} */
export const VIRIDIS = [
  [68, 1, 84],
  [72, 26, 108],
  [71, 47, 125],
  [65, 68, 135],
  [57, 86, 140],
  [49, 104, 142],
  [42, 120, 142],
  [35, 136, 142],
  [31, 152, 139],
  [34, 168, 132],
  [53, 183, 121],
  [84, 197, 104],
  [122, 209, 81],
  [165, 219, 54],
  [210, 226, 27],
  [253, 231, 37],
];

/** Colours of differences, in equal steps: the second method ahead, neither, the first method ahead.
 *
 * @type {Themed[]} */
export const DIVERGING = [
  { light: [107, 61, 0], dark: [253, 210, 110] },
  { light: [230, 159, 0], dark: [214, 150, 20] },
  { light: [243, 207, 128], dark: [112, 80, 16] },
  { light: [244, 244, 244], dark: [52, 56, 64] },
  { light: [128, 184, 216], dark: [24, 86, 128] },
  { light: [0, 114, 178], dark: [60, 150, 210] },
  { light: [0, 50, 79], dark: [150, 205, 240] },
];

/** Colours of a test's outcome between two methods. */
export const VERDICTS = /** @type {const} */ ({
  first: { light: [0, 114, 178], dark: [86, 160, 215] },
  second: { light: [230, 159, 0], dark: [230, 159, 0] },
  none: { light: [204, 204, 204], dark: [92, 99, 109] },
  untested: { light: [255, 255, 255], dark: [27, 30, 35] },
});
