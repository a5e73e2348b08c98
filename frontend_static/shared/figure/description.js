/** What is said of a figure: titles of axes, values that are pointed at, and all that a panel shows for who cannot see it. */

import { written } from "./ticks.js";

/** @import { Axis, Panel, Trace } from "./traces.js" */

/** So many steps are told apart on an axis. */
const DIGITS = 3;

/**
 * "position, m"
 *
 * @param {Axis} axis
 */
export function titled({ title, unit }) {
  return title && unit ? `${title}, ${unit}` : title || unit;
}

/**
 * "4.40 m": to a thousandth of the axis, or to three digits where it is logarithmic.
 *
 * @param {Axis} axis
 * @param {number} value
 * @param {number} [step] In which it is turned: no finer is it told.
 */
export function valueOn(axis, value, step) {
  if (axis.names.length) return axis.names[Math.min(Math.max(Math.round(value), 0), axis.names.length - 1)];
  const size = axis.log ? Math.abs(value) : Math.abs(axis.high - axis.low);
  const decimals = Math.max(0, DIGITS - Math.round(Math.log10(size || 1)));
  const text = written(value, Math.min(decimals, step === undefined ? 12 : decimalsOf(step)));
  return axis.unit ? `${text} ${axis.unit}` : text;
}

/**
 * 0.25 -> 2
 *
 * @param {number} step
 */
function decimalsOf(step) {
  const whole = Array.from({ length: 12 }, (_, places) => step * 10 ** places);
  const found = whole.findIndex((each) => Math.abs(each - Math.round(each)) < 1e-6 * each);
  return found < 0 ? 12 : found;
}

/**
 * "position 4.40 m"; only the value where the axis has no title.
 *
 * @param {Axis} axis
 * @param {number} value
 */
export function named(axis, value) {
  return `${axis.title} ${valueOn(axis, value)}`.trim();
}

/**
 * A trace's title before what is said of it.
 *
 * @param {Trace} trace
 * @param {...string} parts
 */
export function saying({ title }, ...parts) {
  return [title, ...parts].filter(Boolean).join(" · ");
}

/**
 * All that a panel shows, for who cannot see it.
 *
 * @param {Panel} panel
 * @param {string} [mark] What is marked in it.
 */
export function describe(panel, mark = "") {
  const drawn = [...new Set(panel.traces.map(({ kind, title }) => (title ? `${title} (${kind})` : kind)))];
  const axes = [along("to the right", panel.x), along("upwards", panel.y)];
  return [panel.title, panel.words, mark, drawn.length ? `Drawn: ${drawn.join(", ")}` : "", ...axes].map(sentence).filter(Boolean).join(" ");
}

/**
 * @param {string} way
 * @param {Axis} axis
 */
function along(way, axis) {
  if (!axis.title) return "";
  if (axis.hidden) return `${axis.title} ${way}`;
  return `${titled(axis)} ${way}, from ${valueOn(axis, axis.low)} to ${valueOn(axis, axis.high)}`;
}

/** @param {string} text */
function sentence(text) {
  const whole = text.trim();
  return whole === "" || /[.!?]$/.test(whole) ? whole : `${whole}.`;
}
