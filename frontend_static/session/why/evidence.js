/** A column of numbers around the frame since when a sign holds, small, with a mark there. */

import { h } from "../../shared/dom.js";
import { miniature } from "../../shared/figure/miniature.js";
import { quantity } from "../../shared/format.js";

/** @import { Evidence } from "../../shared/messages.js" */
/** @import { Axis, Line } from "../../shared/figure/traces.js" */

/**
 * @param {Evidence} column
 * @param {number} since The frame that is marked.
 * @param {AbortSignal} signal Takes the figure away.
 */
export function evidence({ title, unit, first, values }, since, signal) {
  const known = values.filter((value) => value !== null);
  const [low, high] = [Math.min(...known), Math.max(...known)];
  const frames = [first, first + values.length - 1];
  const y = values.map((value) => value ?? NaN);
  const x = values.map((_, place) => first + place);
  const traces = [
    { ...line([since, since], [low, high]), ink: "lost", width: 1.5, dashed: true },
    { ...line(x, y), ink: "estimate", width: 2 },
  ];
  const range = `${quantity(low, unit)} to ${quantity(high, unit)} ${unit}`.trim();
  const words = `${title}, ${range}, over frames ${frames[0]} to ${frames[1]}; frame ${since} is marked`;
  const panel = { x: axis(frames[0], Math.max(frames[1], frames[0] + 1)), y: axis(low, high > low ? high : low + 1), traces };
  return h("figure", { class: "evidence", title: words }, miniature(panel, words, signal), h("figcaption", {}, h("span", {}, title), h("span", {}, range)));
}

/**
 * @param {readonly number[]} x
 * @param {readonly number[]} y
 * @returns {Line}
 */
function line(x, y) {
  return { kind: "line", title: "", name: "", ink: "", x, y, width: 1, said: "", unit: "" };
}

/**
 * @param {number} low
 * @param {number} high
 * @returns {Axis}
 */
function axis(low, high) {
  return { title: "", unit: "", low, high, log: false, names: [], hidden: true };
}
