/**
 * What the page knows of its sweep, and what a person has chosen to see of it, which the address names, so that a link shows
 * the same. The server decides; its newest message counts.
 */

import { messageOf } from "../shared/api.js";
import { lastOfAddress } from "../shared/dom.js";
import { Stream } from "../shared/stream.js";
import { throttle } from "../shared/timing.js";
import { batch, computed, signal } from "../vendor/preact.js";
import { sweepStream, sweeps } from "./api.js";
import { quantitiesOf } from "./cells.js";

/** @import { Cells, CellsPublic, ComparisonPublic, SweepMessage, SweepPublic } from "../shared/messages.js" */
/** @import { Quantity } from "./cells.js" */

/**
 * What is shown, as words of an address.
 *
 * @typedef {object} View
 * @property {string} show "values" of single trackers, or the "difference" or "significance" of two.
 * @property {string} of Name of the quantity that is shown, or that two trackers are compared by.
 * @property {string} x Name of the axis across.
 * @property {string} y Name of the axis up.
 * @property {string} first
 * @property {string} second
 * @property {string} level
 * @property {string} correction "none" or "holm"
 * @property {string} test "chi-square" or "fisher"
 */

/** @typedef {{i: number, j: number, tracker: string|null, nth: number}} Chosen A cell, the tracker of its map, and how many were chosen with it. */

/**
 * The sweep as it is shown.
 *
 * @typedef {object} Seen
 * @property {SweepPublic} sweep
 * @property {CellsPublic} cells
 * @property {View} view
 * @property {Quantity} quantity
 * @property {boolean} compares Whether the maps show one tracker against another.
 * @property {ComparisonPublic|null} comparison
 * @property {string} problem Why there is no comparison.
 */

const COMPARE_EVERY_MS = 1000;
/** The server closes the stream so where the sweep has no such axes. */
const REFUSED = 4422;
export const NO_AXIS = "none";
/** Where an address does not say otherwise; what is empty is the first that the sweep has. */
const USUAL = { show: "values", of: "", x: "", y: "", first: "", second: "", level: "0.01", correction: "none", test: "chi-square" };

/** The sweep as it is now. */
export const newest = signal(/** @type {SweepPublic|null} */ (null));
const cells = signal(/** @type {CellsPublic|null} */ (null));
const wish = signal(/** @type {View} */ (USUAL));
/** Or why there is none. */
const comparison = signal(/** @type {ComparisonPublic|string|null} */ (null));
/** The cell whose runs are listed. */
export const chosen = signal(/** @type {Chosen|null} */ (null));
export const isLost = signal(false);
/** Why the sweep cannot be shown. */
export const gone = signal(/** @type {string|null} */ (null));

export const seen = computed(() => {
  if (newest.value === null || cells.value === null) return null;
  const found = comparison.value;
  const isFound = typeof found === "object";
  return { ...viewOf(wish.value, newest.value, cells.value), comparison: isFound ? found : null, problem: isFound ? "" : found };
});

/**
 * The view that a wish gives: what the sweep does not have is replaced by what it has.
 *
 * @param {View} wanted
 * @param {SweepPublic} known
 * @param {CellsPublic} map
 * @returns {Omit<Seen, "comparison"|"problem">}
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
  return { sweep: known, cells: map, view, quantity, compares };
}

/**
 * @param {URLSearchParams} query
 * @returns {View}
 */
export function wishOf(query) {
  return { ...USUAL, ...Object.fromEntries(query) };
}

/** @param {View} view */
export function queryOf(view) {
  const usual = new Map(Object.entries(USUAL));
  return new URLSearchParams(Object.entries(view).filter(([name, value]) => value !== usual.get(name)));
}

/** Show what the address says, and follow the sweep from now on. */
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
    { address: () => sweepStream(id, axes()), look: () => sweeps.cells(id, axes()) },
  );
}

/** @type {Stream<SweepMessage>|null} */
let stream = null;

/** The axes of the maps; the server chooses where none are named. */
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

/**
 * The cells with those that have changed. Columns are long and few of their cells change, so they are not copied.
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

/**
 * Change what is shown.
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
  const query = queryOf(wish.value);
  history.replaceState(null, "", query.size > 0 ? `${location.pathname}?${query}` : location.pathname);
  if (isOtherMap) stream?.again();
  compare();
}

/**
 * List the runs of a cell.
 *
 * @param {{i: number, j: number}} cell
 * @param {string|null} tracker List its runs alone.
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
    const { comparison: found } = await sweeps.cells(now.sweep.id, { ...asked, measure });
    if (isNewest()) comparison.value = found;
  } catch (error) {
    if (isNewest()) comparison.value = messageOf(error);
  }
}, COMPARE_EVERY_MS);
