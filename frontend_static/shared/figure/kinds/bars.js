/** Bars at 0, 1, 2, ... of the axis that has names; or lying end to end, as shares of a whole. */

import { REACH, shade, stroke } from "../canvas.js";
import { named, saying, valueOn } from "../description.js";
import { written } from "../ticks.js";

/** @import { Bars } from "../traces.js" */
/** @import { Among } from "./kinds.js" */
/** @import { Hit, Sheet } from "../canvas.js" */

/** Of the distance between two bars. */
const WIDE = 0.8;
/** Neighbours in a stack differ, whatever is beside them. */
const SHADES = [0.75, 0.3, 0.5];

/** @typedef {{left: number, top: number, width: number, height: number, value: number, index: number}} Bar px */

/**
 * @param {Sheet} sheet
 * @param {Bars} bars
 * @param {Among} among
 */
export function paint(sheet, bars, among) {
  const outlines = new Path2D();
  for (const { left, top, width, height, index } of laid(sheet, bars, among)) {
    const path = new Path2D();
    path.rect(left, top, width, height);
    shade(sheet, path, bars.ink, bars.stacked ? SHADES[index % SHADES.length] : 0.6);
    outlines.addPath(path);
  }
  stroke(sheet, outlines, bars.ink, { solid: 1 });
}

/**
 * @param {Sheet} sheet
 * @param {Bars} bars
 * @param {number} px
 * @param {number} py
 * @param {Among} among
 * @returns {Hit|null}
 */
export function near(sheet, bars, px, py, among) {
  const hit = laid(sheet, bars, among).find(
    ({ left, top, width, height }) => px >= left && px <= left + width && py >= top && py <= top + height,
  );
  if (hit === undefined) return null;
  const { x, y } = sheet.axes;
  const [place, amount] = isLying(sheet) ? [y, x] : [x, y];
  const words = bars.stacked
    ? saying(bars, `number ${hit.index + 1}`, written(Number(hit.value.toPrecision(3))))
    : saying(bars, valueOn(place, hit.index), named(amount, hit.value));
  return { distance: REACH * sheet.unit, x: hit.left + hit.width / 2, y: hit.top, words };
}

/**
 * @param {Bars} bars
 * @returns {Bars} For the key.
 */
export function sample(bars) {
  return { ...bars, heights: bars.stacked ? [0.45, 0.3, 0.25] : [0.9, 0.5] };
}

/**
 * Where each bar lies.
 *
 * @param {Sheet} sheet
 * @param {Bars} bars
 * @param {Among} among
 * @returns {Bar[]}
 */
function laid(sheet, bars, among) {
  return bars.stacked ? endToEnd(sheet, bars, among) : sideBySide(sheet, bars, among);
}

/**
 * @param {Sheet} sheet
 * @param {Bars} bars
 * @param {Among} among
 * @returns {Bar[]}
 */
function sideBySide(sheet, { heights }, { index: which, count }) {
  const lying = isLying(sheet);
  const [along, up] = lying ? [sheet.y, sheet.x] : [sheet.x, sheet.y];
  const ground = up.at(up.ground);
  return heights.flatMap((value, index) => {
    if (value === null) return [];
    const [from, to] = [0, 1].map((end) => along.at(index - WIDE / 2 + (WIDE * (which + end)) / count));
    const top = up.at(value);
    const [low, high] = [Math.min(from, to), Math.max(from, to)];
    const [start, end] = [Math.min(ground, top), Math.max(ground, top)];
    const box = lying
      ? { left: start, width: end - start, top: low, height: high - low }
      : { left: low, width: high - low, top: start, height: end - start };
    return [{ ...box, value, index }];
  });
}

/**
 * @param {Sheet} sheet
 * @param {Bars} bars
 * @param {Among} among
 * @returns {Bar[]}
 */
function endToEnd({ x, y, axes }, { heights }, { index: which }) {
  const [one, other] = axes.y.names.length ? [which - WIDE / 2, which + WIDE / 2] : [0, 1];
  const [top, bottom] = [y.at(one), y.at(other)].sort((first, second) => first - second);
  let before = 0;
  return heights.map((height, index) => {
    const value = height ?? 0;
    const [left, right] = [x.at(before), x.at(before + value)];
    before += value;
    return { left, width: right - left, top, height: bottom - top, value, index };
  });
}

/** @param {Sheet} sheet */
function isLying({ axes }) {
  return axes.y.names.length > 0 && axes.x.names.length === 0;
}
