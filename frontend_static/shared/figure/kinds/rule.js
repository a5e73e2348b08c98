/** A line across the panel at a value. */

import { stroke } from "../canvas.js";
import { named, saying } from "../description.js";

/** @import { Rule } from "../traces.js" */
/** @import { Hit, Sheet } from "../canvas.js" */

/**
 * @param {Sheet} sheet
 * @param {Rule} rule
 */
export function paint(sheet, rule) {
  const { left, top, width, height } = sheet.box;
  const path = new Path2D();
  if (rule.along === "x") {
    const at = sheet.x.at(rule.at);
    path.moveTo(at, top);
    path.lineTo(at, top + height);
  } else {
    const at = sheet.y.at(rule.at);
    path.moveTo(left, at);
    path.lineTo(left + width, at);
  }
  stroke(sheet, path, rule.ink, rule);
}

/**
 * @param {Sheet} sheet
 * @param {Rule} rule
 * @param {number} px
 * @param {number} py
 * @returns {Hit|null}
 */
export function near(sheet, rule, px, py) {
  const at = sheet[rule.along].at(rule.at);
  const [x, y] = rule.along === "x" ? [at, py] : [px, at];
  return { x, y, distance: Math.hypot(x - px, y - py), words: saying(rule, named(sheet.axes[rule.along], rule.at)) };
}

/**
 * @param {Rule} rule
 * @returns {Rule} For the key: it stands as it does in the panel.
 */
export function sample(rule) {
  return { ...rule, at: 0.5 };
}
