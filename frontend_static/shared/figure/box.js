/** Where in a panel its axes enclose what is drawn, and how much room their numbers take. */

import { Scale } from "./scale.js";
import { ticksOf } from "./ticks.js";
import { titled } from "./description.js";

/** @import { Tick } from "./ticks.js" */
/** @import { Axis, Panel } from "./traces.js" */

/** @typedef {{left: number, top: number, width: number, height: number}} Box px of the page within the panel's plot. */
/** @typedef {{left: number, right: number, bottom: number}} Margins px around the box. */

/** The smallest box that is worth painting, px. */
const LEAST = 8;
/** Height of a line of letters, in their size; what follows likewise. */
export const LINE = 1.25;
export const GAP = 0.45;
const APART = { x: 5, y: 1.9 };
/** About what stands beside a box. */
const ASIDE = 4;
/** More numbers than that help nobody. */
const MOST = { x: 11, y: 7 };
/** Margins grow in such steps, so that another digit seldom moves the box. */
const STEP = 0.5;

/**
 * What stands around a panel's box.
 *
 * @typedef {object} Furniture
 * @property {Tick[]} x
 * @property {Tick[]} y
 * @property {string} below Title of the axis to the right.
 * @property {string} beside Title of the axis upwards.
 * @property {number} lines How many lines of letters that takes.
 */

/**
 * The ticks and titles that there is room for.
 *
 * @param {Panel} panel
 * @param {{width: number, height: number}} room px
 * @param {number} em Size of the letters, px.
 * @param {(text: string) => number} wide Width of a text, px.
 * @param {boolean} sharesX Whether a panel below has the same axis and says its numbers.
 * @returns {Furniture}
 */
export function furniture(panel, { width, height }, em, wide, sharesX) {
  const room = (/** @type {"x"|"y"} */ along, /** @type {number} */ px) => Math.min(Math.max(2, Math.floor(px / (APART[along] * em))), MOST[along]);
  const ticks = ticksOf(panel.x, room("x", width));
  const { names } = panel.x;
  const numbered = names.length ? apart(ticks, (width - ASIDE * em) / names.length, Math.max(...names.map(wide)) + GAP * em) : ticks;
  const x = sharesX ? ticks.map(({ at }) => ({ at, text: "" })) : numbered;
  const left = (/** @type {string} */ below) => height - GAP * em - under({ x, below }, em);
  // Where nothing would be left to paint on, a title gives way.
  const below = sharesX || left(titled(panel.x)) < LEAST ? "" : titled(panel.x);
  const high = left(below);
  const across = ticksOf(panel.y, room("y", high));
  const y = panel.y.names.length ? apart(across, high / panel.y.names.length, LINE * em) : across;
  const isBroken = titled(panel.y).split(" ").some((word) => wide(word) > high);
  const beside = isBroken ? panel.y.unit : titled(panel.y);
  return { x, y, below, beside, lines: Number(beside !== "") + Number(wide(beside) > high) };
}

/**
 * Names that stand as far apart as they are long: all, or each second, or third; numbers are given room before.
 *
 * @param {Tick[]} ticks
 * @param {number} room For each, px.
 * @param {number} needed For each, px.
 */
function apart(ticks, room, needed) {
  const every = Math.max(1, Math.ceil(needed / room));
  return ticks.map(({ at, text }, place) => ({ at, text: place % every ? "" : text }));
}

/**
 * Height of what stands below the box, px.
 *
 * @param {Pick<Furniture, "x"|"below">} around
 * @param {number} em
 */
function under({ x, below }, em) {
  return (x.some(({ text }) => text) ? LINE * em + GAP * em : GAP * em) + (below ? LINE * em : 0);
}

/**
 * @param {Furniture} around
 * @param {(text: string) => number} wide Width of a text, px.
 * @param {number} em
 * @returns {Margins}
 */
export function margins({ x, y, below, lines }, wide, em) {
  const numbers = Math.max(0, ...y.map(({ text }) => wide(text)));
  const [first, last] = [x[0], x[x.length - 1]].map((tick) => (tick ? wide(tick.text) / 2 : 0));
  const step = (/** @type {number} */ px) => Math.ceil(px / (STEP * em)) * STEP * em;
  return {
    left: step(Math.max(lines * LINE * em + (numbers ? numbers + GAP * em : 0) + GAP * em, first)),
    right: step(Math.max(last, GAP * em)),
    bottom: under({ x, below }, em),
  };
}

/**
 * @param {Panel} panel
 * @param {{width: number, height: number}} room px
 * @param {Margins} around
 * @param {number} em
 * @returns {Box}
 */
export function boxOf(panel, { width, height }, { left, right, bottom }, em) {
  const top = GAP * em;
  /** @type {Box} */
  const box = { left, top, width: Math.max(LEAST, width - left - right), height: Math.max(LEAST, height - top - bottom) };
  const [across, up] = [Math.abs(panel.x.high - panel.x.low) || 1, Math.abs(panel.y.high - panel.y.low) || 1];
  const { unit_px: most = Infinity } = panel;
  return whole({ ...box, width: Math.min(box.width, most * across), height: Math.min(box.height, most * up) });
}

/**
 * The scales of a panel in its box.
 *
 * @param {Panel} panel
 * @param {Box} box
 */
export function scales(panel, { left, top, width, height }) {
  return { x: new Scale(panel.x, left, left + width), y: new Scale(panel.y, top + height, top) };
}

/**
 * Whether two axes are the same for who reads them.
 *
 * @param {Axis} one
 * @param {Axis} other
 */
export function isSame(one, other) {
  return JSON.stringify(one) === JSON.stringify(other);
}

/** @param {Box} box */
function whole({ left, top, width, height }) {
  return { left: Math.round(left), top: Math.round(top), width: Math.round(width), height: Math.round(height) };
}
