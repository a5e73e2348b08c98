/** Lines with words at places of a panel: what was predicted, and what is exact. */

import { h } from "../dom.js";
import { valueOn } from "./description.js";

/** @import { Box } from "./box.js" */
/** @import { Scale } from "./scale.js" */
/** @import { Axis } from "./traces.js" */

/** @typedef {{panel: string, along: "x"|"y", at: number|null, exact: number|null}} Mark What was placed, and what is exact. */

/**
 * What is said of a mark.
 *
 * @param {Mark} mark
 * @param {Axis} axis
 */
export function wordsOf({ at, exact }, axis) {
  const words = [];
  if (at !== null) words.push(`your prediction ${valueOn(axis, at)}`);
  if (exact !== null) words.push(`exactly ${valueOn(axis, exact)}`);
  return words.join(", ");
}

/**
 * @param {Mark} mark
 * @param {Axis} axis
 * @param {Scale} scale
 * @param {Box} box
 */
export function markLines({ along, at, exact }, axis, scale, box) {
  const both = at !== null && exact !== null;
  const placed = at !== null && one("placed", "your prediction", at);
  const right = exact !== null && one("exact", "exactly", exact);
  return [placed, right].filter((element) => element !== false);

  /**
   * @param {string} name
   * @param {string} title
   * @param {number} value
   */
  function one(name, title, value) {
    const px = scale.at(value);
    const far = along === "x" ? px > box.left + box.width / 2 : px < box.top + box.height / 2;
    const flag = h("span", { class: "figure-flag" }, `${title} ${valueOn(axis, value)}`);
    const isSecond = both && name === "exact";
    const line = h("div", { class: `figure-mark ${name}`, "aria-hidden": "true", "data-along": along, "data-far": far, "data-second": isSecond }, flag);
    const place = along === "x" ? { left: px, top: box.top, height: box.height, width: 0 } : { left: box.left, top: px, width: box.width, height: 0 };
    for (const [side, length] of Object.entries(place)) line.style.setProperty(side, `${length}px`);
    return line;
  }
}
