/** The page's state of its sweep, and the person's chosen view, which is in the address, so that a link shows the same. The server's newest
 message decides. */

import { messageOf, request } from "../shared/api.js";
import { lastOfAddress } from "../shared/dom.js";
import { socketAddress, Stream } from "../shared/stream.js";
import { diverging, SIGNS, verdict, viridis } from "../shared/theme.js";
import { throttle } from "../shared/timing.js";
import { batch, computed, signal } from "../vendor/preact.js";

/** @import { Query } from "../shared/api.js" */
/** @import { CellLook } from "../shared/figure/traces.js" */
/** @import * as Messages from "../shared/messages.js" */
/** @import { Cells, CellsPublic, ComparisonPublic, MapPublic, MeasurePublic, SweepMessage, SweepPublic } from "../shared/messages.js" */

// The server's interface for sweeps.

/** A typed plan: an empty field is null, and the server reports what is missing.
 *
 * @typedef {{[Name in keyof Messages.SweepCreate]: Messages.SweepCreate[Name]|null}} Plan
 */

/** The page that opens a run as a session, optionally with another method.
 *
 * @param {string} id
 * @param {number} run
 * @param {string} [tracker]
 */
export function runPage(id, run, tracker) {
  return `sweep/${encodeURIComponent(id)}/run/${run}${tracker ? `?tracker=${encodeURIComponent(tracker)}` : ""}`;
}

/**
 * "h-SPF" of "Hard switching (h-SPF)".
 *
 * @param {string} title Title of a tracker.
 */
export function shortTitle(title) {
  return /\(([^)]+)\)$/.exec(title)?.[1] ?? title;
}

// The quantities of a sweep, and the look of cells.

/** @typedef {(number|null)[]} Column A number for each cell. */

/** A quantity that maps can show, or by which two trackers can be compared.
 *
 * @typedef {object} Quantity
 * @property {string} name The server's name of it.
 * @property {string} words
 * @property {string} title Meaning of the colours.
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

/** The quantities of a sweep; without truth there is neither success nor error.
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
 * The look of one tracker's cells.
 *
 * @param {Seen} seen
 * @param {MapPublic} map
 * @returns {(index: number) => CellLook}
 */
export function methodLook({ sweep, cells, quantity, end: { most } }, map) {
  const { isShare, isBetterHigh } = quantity;
  const values = quantity.values(map);
  return (index) => {
    const value = values[index] ?? null;
    const there = presence(sweep, cells.planned, map, index);
    if (value === null) return { ...there, colour: null };
    return { ...there, colour: viridis(isBetterHigh ? value / most : 1 - value / most), text: isShare ? share2(value) : short(value) };
  };
}

/** The look of a comparison of two trackers.
 *
 * @param {Seen} seen
 * @returns {(index: number) => CellLook}
 */
export function comparisonLook({ sweep, cells, view, quantity, comparison, maps, differenceEnd: { most } }) {
  return (index) => {
    // Cells without an answer yet are empty; that is not the same as without a value.
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

/** The computed share of a cell.
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
  // A stopped sweep shows cells whole: nothing will fill the rest.
  const filled = runs >= planned || (isOver && runs > 0) ? 1 : runs / planned;
  return { isHatched: isRefused || (runs === 0 && isOver), filled: isRefused ? 0 : filled };
}

/**
 * 0.572 -> ".57", 1 -> "1".
 *
 * @param {number} value
 */
export function share2(value) {
  return value === 0 || value === 1 ? `${value}` : value.toFixed(2).replace(/^0/, "");
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
 * @param {boolean} [isShare]
 */
export function signed(value, isShare = false) {
  const text = isShare ? share2(Math.abs(value)) : short(Math.abs(value));
  return Number(text) === 0 ? "0" : `${value > 0 ? "+" : "−"}${text}`;
}

/**
 * Return the end of a scale. A few outliers, from cells with few runs, must not make all other cells look alike.
 *
 * @param {Pick<Quantity, "isShare">} quantity
 * @param {Column} column
 * @returns {End}
 */
export function endOf({ isShare }, column) {
  if (isShare) return WHOLE;
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

/** The view, as words of an address.
 *
 * @typedef {object} View
 * @property {string} show "values" of single trackers, or the "difference" or "significance" of two.
 * @property {string} of Name of the shown quantity, or of the quantity of a comparison.
 * @property {string} x Name of the x axis.
 * @property {string} y Name of the y axis.
 * @property {string} first
 * @property {string} second
 * @property {string} level
 * @property {string} correction "none" or "holm"
 */

/** @typedef {{i: number, j: number, tracker: string|null, nth: number}} Chosen A cell, the tracker of its map, and how many were chosen with it. */

/** The shown sweep.
 *
 * @typedef {object} Seen
 * @property {SweepPublic} sweep
 * @property {CellsPublic} cells
 * @property {View} view
 * @property {Quantity} quantity
 * @property {boolean} compares Whether the maps compare two trackers.
 * @property {readonly MapPublic[]} maps Maps of the shown trackers, in order.
 * @property {End} end The nonzero end of the quantity's scale, the same in all maps.
 * @property {End} differenceEnd The end of the symmetric scale of differences.
 * @property {ComparisonPublic|null} comparison
 * @property {string} problem Why there is no comparison.
 */

const COMPARE_EVERY_MS = 1000;
/** The server's close code if the sweep has no such axes. */
const REFUSED = 4422;
export const NO_AXIS = "none";
/** Defaults of an address; an empty one is the sweep's first. */
const USUAL = { show: "values", of: "", x: "", y: "", first: "", second: "", level: "0.01", correction: "none" };

/** The present sweep. */
export const newest = signal(/** @type {SweepPublic|null} */ (null));
const cells = signal(/** @type {CellsPublic|null} */ (null));
const wish = signal(/** @type {View} */ (USUAL));
/** The reason why there is none. */
const comparison = signal(/** @type {ComparisonPublic|string|null} */ (null));
/** The cell whose runs are listed. */
export const chosen = signal(/** @type {Chosen|null} */ (null));
export const isLost = signal(false);
/** Why the sweep cannot be shown. */
export const gone = signal(/** @type {string|null} */ (null));

export const seen = computed(() => {
  if (newest.value === null || cells.value === null) return null;
  const now = viewOf(wish.value, newest.value, cells.value);
  const [found, problem] = typeof comparison.value === "string" ? [null, comparison.value] : [comparison.value, ""];
  const end = endOf(now.quantity, now.cells.maps.flatMap(now.quantity.values));
  const differences = (found?.difference ?? []).map((value) => value && Math.abs(value));
  return { ...now, end, differenceEnd: endOf(now.quantity, differences), comparison: found, problem };
});

/** The view for a wish; names that the sweep does not have are replaced.
 *
 * @param {View} wanted
 * @param {SweepPublic} known
 * @param {CellsPublic} map
 * @returns {Omit<Seen, "end"|"differenceEnd"|"comparison"|"problem">}
 */
export function viewOf(wanted, known, map) {
  const ids = known.trackers.map(({ id }) => id);
  const first = ids.find((id) => id === wanted.first) ?? ids.find((id) => id !== wanted.second) ?? ids[0];
  const second = ids.find((id) => id === wanted.second && id !== first) ?? ids.find((id) => id !== first) ?? first;
  const quantities = quantitiesOf(known);
  const quantity = quantities.find(({ name }) => name === wanted.of) ?? quantities[0];
  const compares = ids.length > 1 && ["difference", "significance"].includes(wanted.show);
  const show = compares ? wanted.show : USUAL.show;
  const view = { ...wanted, show, of: quantity.name, first, second, x: map.x.name, y: map.y?.name ?? NO_AXIS };
  const maps = compares ? [first, second].flatMap((id) => map.maps.filter(({ tracker }) => tracker === id)) : map.maps;
  return { sweep: known, cells: map, view, quantity, compares, maps };
}

/**
 * @param {URLSearchParams} address
 * @returns {View}
 */
export function wishOf(address) {
  return { ...USUAL, ...Object.fromEntries([...address].filter(([name]) => name in USUAL)) };
}

/** @param {View} view */
export function queryOf(view) {
  const usual = new Map(Object.entries(USUAL));
  return new URLSearchParams(Object.entries(view).filter(([name, value]) => value !== usual.get(name)));
}

/** Show the address's view, and follow the sweep from now on. */
export function begin() {
  const id = lastOfAddress();
  wish.value = wishOf(new URLSearchParams(location.search));
  stream = new Stream(
    {
      message: receive,
      lost: () => (isLost.value = true),
      closed: ({ code }) => code === REFUSED && look({ x: USUAL.x, y: USUAL.y }),
      gone: ({ message }) => (gone.value = message),
    },
    {
      address: () => socketAddress("WS sweeps/{sweep}/stream", { sweep: id, ...axes() }),
      look: () => request("GET sweeps/{sweep}/cells", { sweep: id, ...axes() }),
    },
  );
}

/** @type {Stream<SweepMessage>|null} */
let stream = null;

/** The axes of the maps; the server chooses if none are named. */
function axes() {
  const { x, y } = wish.value;
  return { ...(x && { x }), ...(y && { y }) };
}

/** @param {SweepMessage} message */
function receive(message) {
  batch(() => {
    isLost.value = false;
    if (message.type === "cells") cells.value = cells.value && merged(cells.value, message);
    else newest.value = message.sweep;
    if (message.type === "hello") cells.value = message.cells;
  });
  if (message.type !== "progress") compare();
}

/** Apply changed cells. Columns are long and few of their cells change, so they are not copied.
 *
 * @param {CellsPublic} before
 * @param {Cells} message
 */
function merged(before, { at, maps, done }) {
  const put = (/** @type {Record<string, unknown>} */ columns, /** @type {Record<string, unknown>} */ changed) => {
    for (const [name, column] of Object.entries(columns)) {
      const some = changed[name];
      if (Array.isArray(column) && Array.isArray(some)) at.forEach((index, place) => (column[index] = some[place]));
    }
  };
  maps.forEach((changed, place) => {
    put({ ...before.maps[place] }, { ...changed });
    put(before.maps[place].measures, changed.measures);
  });
  return { ...before, done };
}

/** Change the view.
 *
 * @param {Partial<View>} changes
 */
export function look(changes) {
  const isOtherMap = "x" in changes || "y" in changes;
  batch(() => {
    wish.value = { ...wish.value, ...changes };
    comparison.value = null;
    if (isOtherMap) chosen.value = null;
  });
  const address = queryOf(wish.value);
  history.replaceState(null, "", address.size > 0 ? `${location.pathname}?${address}` : location.pathname);
  if (isOtherMap) stream?.again();
  compare();
}

/**
 * List the runs of a cell.
 *
 * @param {{i: number, j: number}} cell
 * @param {string|null} tracker List only its runs.
 */
export function choose({ i, j }, tracker) {
  chosen.value = { i, j, tracker, nth: (chosen.value?.nth ?? 0) + 1 };
}

const compare = throttle(async () => {
  const now = seen.value;
  if (!now?.compares) return;
  const { show: _, of: measure, ...asked } = now.view;
  const isNewest = () => JSON.stringify(seen.value?.view) === JSON.stringify(now.view);
  try {
    const { comparison: found } = await request("GET sweeps/{sweep}/cells", { ...asked, measure, sweep: now.sweep.id });
    if (isNewest()) comparison.value = found;
  } catch (error) {
    if (isNewest()) comparison.value = messageOf(error);
  }
}, COMPARE_EVERY_MS);
