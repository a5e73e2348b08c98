/** What can be shown of a sweep, and what a cell looks like then. */

import { SIGNS, diverging, verdict, viridis } from "../shared/colours.js";

/** @import { CellLook } from "../shared/figure/traces.js" */
/** @import { MapPublic, MeasurePublic, SweepPublic } from "../shared/messages.js" */
/** @import { Seen } from "./store.js" */

/** @typedef {(number|null)[]} Column A number for each cell. */

/**
 * What the maps can show of each tracker, and what two trackers can be compared by.
 *
 * @typedef {object} Quantity
 * @property {string} name As the server names it.
 * @property {string} words
 * @property {string} title What the colours mean.
 * @property {string} unit
 * @property {boolean} isShare Whether it is a share of the runs or of their frames, 0..1.
 * @property {boolean} isBetterHigh
 * @property {(map: MapPublic) => Column} values
 * @property {MeasurePublic|null} measure
 */

/** @typedef {{most: number, words: string}} End The end of a scale, and what follows the number there. */

/** @type {Quantity} */
const SUCCESS = {
  name: "success",
  words: "success",
  title: "Success rate",
  unit: "",
  isShare: true,
  isBetterHigh: true,
  values: ({ rate }) => rate,
  measure: null,
};
/** @type {Quantity} */
const ERROR = { ...SUCCESS, name: "error", words: "error", title: "Mean error", isShare: false, isBetterHigh: false, values: ({ error }) => error };
/** @type {End} */
const WHOLE = { most: 1, words: "" };
const USUAL_SHARE = 0.95;

/**
 * Without truth there is neither success nor error.
 *
 * @param {Pick<SweepPublic, "judged"|"has_truth"|"measures"|"unit">} sweep
 * @returns {Quantity[]}
 */
export function quantitiesOf({ judged, has_truth, measures, unit }) {
  return [...(judged ? [SUCCESS] : []), ...(has_truth ? [{ ...ERROR, unit }] : []), ...measures.map(quantityOf)];
}

/**
 * @param {MeasurePublic} measure
 * @returns {Quantity}
 */
function quantityOf(measure) {
  const { name, title, unit, how, better } = measure;
  const isShare = how === "share";
  return {
    name,
    words: title,
    title: `${title}, mean of all runs`,
    unit: isShare ? "" : unit,
    isShare,
    isBetterHigh: better === "higher",
    values: ({ measures }) => measures[name] ?? [],
    measure,
  };
}

/**
 * The end of a quantity's scale that is not 0, the same in all maps.
 *
 * @param {Quantity} quantity
 * @param {readonly MapPublic[]} maps
 * @returns {End}
 */
export function endOf({ isShare, values }, maps) {
  return isShare ? WHOLE : usualEnd(maps.flatMap(values));
}

/**
 * The end of the differences' scale, the same to both sides.
 *
 * @param {Pick<Quantity, "isShare">} quantity
 * @param {Column} difference
 * @returns {End}
 */
export function differenceEnd({ isShare }, difference) {
  return isShare ? WHOLE : usualEnd(difference.map((value) => value && Math.abs(value)));
}

/**
 * The look of one tracker's cells.
 *
 * @param {Pick<Seen, "sweep"|"cells"|"quantity">} seen
 * @param {MapPublic} map
 * @returns {(index: number) => CellLook}
 */
export function methodLook({ sweep, cells, quantity }, map) {
  const { isShare, isBetterHigh } = quantity;
  const values = quantity.values(map);
  const { most } = endOf(quantity, cells.maps);
  return (index) => {
    const value = values[index] ?? null;
    const there = presence(sweep, cells.planned, map, index);
    if (value === null) return { ...there, colour: null };
    return { ...there, colour: viridis(isBetterHigh ? value / most : 1 - value / most), text: isShare ? share2(value) : short(value) };
  };
}

/**
 * The look of one tracker against another.
 *
 * @param {Seen} seen
 * @returns {(index: number) => CellLook}
 */
export function comparisonLook({ sweep, cells, view, quantity, comparison }) {
  const maps = cells.maps.filter(({ tracker }) => tracker === view.first || tracker === view.second);
  const { most } = differenceEnd(quantity, comparison?.difference ?? []);
  return (index) => {
    // What has not been answered yet is empty, and not without a value.
    if (comparison === null) return { isHatched: false, filled: 0, colour: null };
    const each = maps.map((map) => presence(sweep, cells.planned, map, index));
    const there = { isHatched: each.some(({ isHatched }) => isHatched), filled: Math.min(...each.map(({ filled }) => filled)) };
    if (view.show === "significance") {
      const code = comparison.verdict[index];
      return { ...there, colour: there.filled > 0 ? verdict(code) : null, isOutlined: true, text: SIGNS[code] };
    }
    const value = comparison.difference[index];
    if (value === null) return { ...there, colour: null };
    return { ...there, colour: diverging(value / most), text: signed(value, quantity.isShare) };
  };
}

/**
 * How much of a cell is there.
 *
 * @param {Pick<SweepPublic, "state">} sweep
 * @param {number} planned
 * @param {MapPublic} map
 * @param {number} index
 */
function presence({ state }, planned, map, index) {
  const runs = map.runs[index];
  const isRefused = runs > 0 && map.problems[index] === runs;
  const isOver = state !== "running";
  // What was stopped shows its values whole: nothing is going to fill the rest.
  const filled = runs >= planned || (isOver && runs > 0) ? 1 : runs / planned;
  return { isHatched: isRefused || (runs === 0 && isOver), filled: isRefused ? 0 : filled };
}

/**
 * 0.572 -> ".57", 1 -> "1".
 *
 * @param {number} value
 */
export function share2(value) {
  if (value === 1) return "1";
  if (value === 0) return "0";
  return value.toFixed(2).replace(/^0/, "");
}

/** @param {number} value */
export function short(value) {
  const size = Math.abs(value);
  if (size >= 100) return value.toFixed(0);
  if (size >= 10) return value.toFixed(1);
  return size >= 0.1 ? value.toFixed(2) : value.toPrecision(2);
}

/**
 * @param {number} value
 * @param {boolean} isShare
 */
function signed(value, isShare) {
  const text = isShare ? share2(Math.abs(value)) : short(Math.abs(value));
  return Number(text) === 0 ? "0" : `${value > 0 ? "+" : "−"}${text}`;
}

/**
 * The end of a scale for amounts: a few outliers, of cells with hardly a run, shall not make all others look alike.
 *
 * @param {Column} column
 * @returns {End}
 */
function usualEnd(column) {
  const values = column.filter((value) => value !== null).sort((a, b) => a - b);
  const most = roundUp(values[Math.ceil((values.length - 1) * USUAL_SHARE)] ?? 0);
  return { most, words: (values.at(-1) ?? 0) > most ? " or more" : "" };
}

/** @param {number} value */
function roundUp(value) {
  if (!(value > 0)) return 1;
  const power = 10 ** Math.floor(Math.log10(value));
  return power * ([1, 1.5, 2, 3, 4, 5, 7.5, 10].find((step) => step * power >= value * 0.999) ?? value / power);
}
