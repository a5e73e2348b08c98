/** The numbers of a history in columns, what else is found in it, and the limits of axes that follow from them. */

/** @import { Spans } from "../../shared/figure/traces.js" */
/** @import { Curve, History, Row } from "../history.js" */

const STEPS = [1, 1.5, 2, 3, 4, 5, 7.5, 10];

/** @type {WeakMap<History, Map<Curve, {edition: number, values: number[]}>>} */
const columns = new WeakMap();

/**
 * A number of all frames, NaN where it is not known. Of a history that has only grown the new frames alone are read.
 *
 * @param {History} history
 * @param {Curve} read The same function each time.
 * @returns {readonly number[]}
 */
export function column(history, read) {
  const known = columns.get(history) ?? new Map();
  columns.set(history, known);
  let found = known.get(read);
  if (found?.edition !== history.edition || found.values.length > history.length) {
    found = { edition: history.edition, values: [] };
    known.set(read, found);
  }
  for (let frame = found.values.length; frame < history.length; frame += 1) found.values.push(read(history.at(frame)) ?? NaN);
  return found.values;
}

/**
 * What `make` finds in a history, found anew only when that has changed.
 *
 * @template T
 * @param {(history: History) => T} make
 * @returns {(history: History) => T}
 */
export function remembered(make) {
  /** @type {WeakMap<History, {seen: string, value: T}>} */
  const known = new WeakMap();
  return (history) => {
    const seen = `${history.edition} ${history.length}`;
    const before = known.get(history);
    const found = before?.seen === seen ? before : { seen, value: make(history) };
    known.set(history, found);
    return found.value;
  };
}

/**
 * Shades of the intervals in which something held, with a word for them in the key where there are any.
 *
 * @param {string} ink
 * @param {number} opacity
 * @param {(row: Row, place: number) => boolean} test Of a frame and, where there are rows, one of them.
 * @param {{word?: string, rows?: number}} [options] How many rows are shaded apart.
 * @returns {(history: History) => Spans}
 */
export function shades(ink, opacity, test, { word = "", rows = 1 } = {}) {
  const intervals = remembered((history) =>
    Array.from({ length: rows }, (_, place) => {
      const part = rows > 1 ? { low: place, high: place + 1 } : {};
      return history.spans((row) => test(row, place)).map(([first, last]) => ({ first: first - 0.5, last: last + 0.5, ...part }));
    }).flat(),
  );
  return (history) => {
    const found = intervals(history);
    return { kind: "spans", title: found.length > 0 ? word : "", name: ink, ink, opacity, intervals: found };
  };
}

/**
 * The smallest and the largest of all; the wrong way round where there is nothing.
 *
 * @param {readonly (readonly number[])[]} all
 * @returns {[number, number]}
 */
export function extent(all) {
  let [low, high] = [Infinity, -Infinity];
  for (const values of all) {
    for (const value of values) {
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  return [low, high];
}

/**
 * From 0 to beyond a value, rounded, so that it changes seldom and nothing jumps.
 *
 * @param {number} most
 */
export function reach(most) {
  const value = most * 1.05;
  const power = 10 ** Math.floor(Math.log10(value));
  return power * (STEPS.find((step) => step * power >= value) ?? value / power);
}

/**
 * Around values that may lie far from 0, rounded.
 *
 * @param {[number, number]} extent The smallest and the largest value.
 * @param {number} smallest How far they are apart at least.
 * @returns {{low: number, high: number}}
 */
export function enclose([low, high], smallest) {
  if (low > high) return { low: 0, high: smallest };
  const span = Math.max(high - low, smallest);
  const step = 10 ** Math.floor(Math.log10(span / 2));
  const start = Math.floor(low / step) * step;
  return { low: start, high: Math.max(Math.ceil(high / step) * step, start + smallest) };
}
