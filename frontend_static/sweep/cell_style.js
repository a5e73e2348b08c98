/** What a cell looks like in each of the ways to see a sweep. */

import { SIGNS, diverging, verdict, viridis } from "../shared/colours.js";

/** @import { CellsPublic, ComparisonPublic, MapPublic, MeasurePublic } from "../shared/messages.js" */
/** @import { CellLook } from "../shared/figure/traces.js" */
/** @import { SweepStore } from "./store.js" */

/** @typedef {{most: number, words: string}} End The end of a scale, and what follows the number there. */

const USUAL_SHARE = 0.95;

/**
 * What is written at the dark end of the errors' scale.
 *
 * @param {Pick<CellsPublic, "maps">} cells
 * @returns {End}
 */
export function errorEnd({ maps }) {
  return endOf(maps.flatMap(({ error }) => error));
}

/**
 * What is written at the ends of the differences' scale, which is the same to both sides.
 *
 * @param {{quantity: SweepStore["quantity"], measure?: Pick<MeasurePublic, "how">, comparison: Pick<ComparisonPublic, "difference">|null}} store
 * @returns {End}
 */
export function differenceEnd({ quantity, measure, comparison }) {
  if (isShareOf(quantity, measure)) return { most: 1, words: "" };
  return endOf((comparison?.difference ?? []).map((value) => value && Math.abs(value)));
}

/**
 * The end of a measure's scale that is not 0.
 *
 * @param {Pick<CellsPublic, "maps">} cells
 * @param {MeasurePublic} measure
 * @returns {End}
 */
export function measureEnd({ maps }, { name, how }) {
  return how === "share" ? { most: 1, words: "" } : endOf(maps.flatMap(({ measures }) => measures[name] ?? []));
}

/**
 * The look of one method's cells; their range is shared by all maps.
 *
 * @param {SweepStore} store
 * @param {CellsPublic} cells
 * @param {MapPublic} map
 * @returns {(index: number) => CellLook}
 */
export function methodLook(store, cells, map) {
  const { values, most, isShare, isBetterHigh } = quantityOf(store, cells, map);
  return (index) => {
    const value = values[index] ?? null;
    const there = presence(store, cells, map, index);
    if (value === null) return { ...there, colour: null };
    return { ...there, colour: viridis(isBetterHigh ? value / most : 1 - value / most), text: isShare ? share2(value) : short(value) };
  };
}

/**
 * What is shown of a method: its values, where their scale ends, and how they are to be read.
 *
 * @param {SweepStore} store
 * @param {CellsPublic} cells
 * @param {MapPublic} map
 */
function quantityOf({ quantity, measure }, cells, map) {
  if (measure !== undefined) {
    const { most } = measureEnd(cells, measure);
    return { values: map.measures[measure.name] ?? [], most, isShare: measure.how === "share", isBetterHigh: measure.better === "higher" };
  }
  if (quantity === "error") return { values: map.error, most: errorEnd(cells).most, isShare: false, isBetterHigh: false };
  return { values: map.rate, most: 1, isShare: true, isBetterHigh: true };
}

/**
 * The look of one method against another.
 *
 * @param {SweepStore} store
 * @param {CellsPublic} cells
 * @returns {(index: number) => CellLook}
 */
export function comparisonLook(store, cells) {
  const { comparison, view, quantity, measure } = store;
  const maps = cells.maps.filter(({ tracker }) => tracker === view.first || tracker === view.second);
  const { most } = differenceEnd(store);
  return (index) => {
    const each = maps.map((map) => presence(store, cells, map, index));
    const there = { isHatched: each.some(({ isHatched }) => isHatched), filled: Math.min(...each.map(({ filled }) => filled)) };
    if (comparison === null) return { ...there, colour: null };
    if (view.show === "significance") {
      const code = comparison.verdict[index];
      return { ...there, colour: there.filled > 0 ? verdict(code) : null, isOutlined: true, text: SIGNS[code] };
    }
    const value = comparison.difference[index];
    if (value === null) return { ...there, colour: null };
    return { ...there, colour: diverging(value / most), text: signed(value, isShareOf(quantity, measure)) };
  };
}

/**
 * How much of a cell is there.
 *
 * @param {SweepStore} store
 * @param {CellsPublic} cells
 * @param {MapPublic} map
 * @param {number} index
 */
function presence({ known }, { planned }, map, index) {
  const runs = map.runs[index];
  const isRefused = runs > 0 && map.problems[index] === runs;
  const isOver = known.state !== "running";
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
 * Whether what is shown is a share of the runs or of their frames.
 *
 * @param {SweepStore["quantity"]} quantity
 * @param {Pick<MeasurePublic, "how">} [measure]
 */
function isShareOf(quantity, measure) {
  return measure === undefined ? quantity === "success" : measure.how === "share";
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
 * @param {(number|null)[]} column
 * @returns {End}
 */
function endOf(column) {
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
