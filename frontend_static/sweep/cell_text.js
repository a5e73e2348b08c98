/** What is said of a cell: where it is, and every method in it. */

import { h } from "../shared/dom.js";
import { count, measureValue, number } from "../shared/format.js";
import { short } from "./cell_style.js";

/** @import { Child } from "../shared/elements.js" */
/** @import { AxisPublic, CellsPublic, ComparisonPublic, MapPublic } from "../shared/messages.js" */
/** @import { Cell } from "../shared/figure/traces.js" */
/** @import { SweepStore } from "./store.js" */

/**
 * @param {SweepStore} store
 * @param {CellsPublic} cells
 * @param {Cell} cell
 * @param {string} id Of the map that is pointed at.
 */
export function describe(store, { x, y, maps }, { i, j }, id) {
  const { comparison } = store;
  const index = j * x.values.length + i;
  return [
    h("p", {}, placeOf(x, i), y && [h("br"), placeOf(y, j)]),
    h("table", {}, maps.map((map) => line(store, map, index, map.tracker === id))),
    comparison && h("p", {}, against(store, comparison, index)),
  ];
}

/**
 * "Occluder width 55 px"
 *
 * @param {AxisPublic} axis
 * @param {number} index
 */
export function placeOf({ title, unit, values }, index) {
  const value = values[index];
  const exact = typeof value === "number" ? Number(value.toPrecision(6)) : value;
  return `${title} ${exact}${unit ? ` ${unit}` : ""}`.trim();
}

/**
 * @param {SweepStore} store
 * @param {MapPublic} map
 * @param {number} index
 * @param {boolean} isHere
 */
function line(store, map, index, isHere) {
  const runs = map.runs[index];
  return h(
    "tr",
    { class: isHere ? "here" : null },
    h("th", {}, store.shortOf(map.tracker)),
    h("td", {}, outcome(store, map, index)),
    h("td", {}, runs > 0 ? count(runs, "run") : ""),
  );
}

/**
 * @param {SweepStore} store
 * @param {MapPublic} map
 * @param {number} index
 * @returns {Child}
 */
function outcome({ known: sweep, measure }, { runs, problems, rate, low, high, error: errors, measures }, index) {
  if (runs[index] === 0) return sweep.state === "running" ? "to come" : "not tested";
  if (problems[index] === runs[index]) return "not possible";
  const error = errors[index];
  const unit = sweep.unit ? ` ${sweep.unit}` : "";
  if (measure !== undefined) return h("strong", {}, measureValue(measures[measure.name]?.[index] ?? null, measure));
  return [
    rate[index] !== null && [h("strong", {}, number(rate[index], 2)), ` (${number(low[index], 2)} – ${number(high[index], 2)})`],
    error !== null && h("span", { class: "tip-error" }, `error ${short(error)}${unit}`),
  ];
}

/**
 * @param {SweepStore} store
 * @param {ComparisonPublic} comparison
 * @param {number} index
 */
function against(store, comparison, index) {
  const { first, second, difference, verdict, p_value: pValues } = comparison;
  const value = difference[index];
  const p = pValues[index];
  const words = {
    first: `${store.shortOf(first)} is better`,
    second: `${store.shortOf(second)} is better`,
    none: "not significant",
    untested: "the test is not applicable",
  };
  return [
    value === null ? "" : `Difference ${value > 0 ? "+" : ""}${short(value)}, `,
    words[verdict[index]],
    p === null ? "" : ` (p ${p < 0.0001 ? "< 0.0001" : `= ${p.toFixed(4)}`})`,
    ...onSameScenes(comparison, index),
  ];
}

/**
 * @param {ComparisonPublic} comparison
 * @param {number} index
 * @returns {Child[]}
 */
function onSameScenes({ paired, paired_low: lows, paired_high: highs, pairs }, index) {
  const [value, low, high] = [paired[index], lows[index], highs[index]];
  if (value === null) return [];
  const interval = low === null || high === null ? "" : ` (${short(low)} to ${short(high)})`;
  return [h("br"), `On the same scenes ${value > 0 ? "+" : ""}${short(value)}${interval}, ${count(pairs[index], "pair")}`];
}
