/** What a cell looks like, and what is said of it, in each of the ways to see a sweep. */

import { SIGNS, diverging, verdict, viridis } from "./colours.js";

const USUAL_SHARE = 0.95;

/** The colours' range of each quantity, shared by all maps. */
export function rangeOf(store, quantity) {
  if (quantity === "success") return [0, 1];
  return [0, scaleOf(store.cells.maps.flatMap((map) => map.error)).most];
}

/** What is written at the dark end of the errors' scale. */
export function errorEnd(store) {
  const { most, isCut } = scaleOf(store.cells.maps.flatMap((map) => map.error));
  return { most, words: isCut ? " or more" : "" };
}

/** The largest difference, rounded up, for a scale that is the same to both sides. */
export function differenceRange(store) {
  return differenceEnd(store).most;
}

/** What is written at the ends of the differences' scale. */
export function differenceEnd(store) {
  if (store.view.measure === "success") return { most: 1, words: "" };
  const { most, isCut } = scaleOf((store.comparison?.difference ?? []).map((value) => value && Math.abs(value)));
  return { most, words: isCut ? " or more" : "" };
}

/** The look of one method's cells. */
export function methodLook(store, map, quantity) {
  const [, most] = rangeOf(store, quantity);
  const values = quantity === "success" ? map.rate : map.error;
  return (index) => {
    const value = values[index];
    const share = quantity === "success" ? value : 1 - value / most;
    return {
      ...presence(store, map, index),
      colour: value === null ? null : viridis(share),
      text: value === null ? "" : quantity === "success" ? share2(value) : short(value),
    };
  };
}

/** The look of one method against another. */
export function comparisonLook(store) {
  const { comparison, view } = store;
  const [first, second] = [view.first, view.second].map((id) => store.cells.maps.find(({ tracker }) => tracker === id));
  const most = differenceRange(store);
  return (index) => {
    const one = presence(store, first, index);
    const other = presence(store, second, index);
    const there = { hatched: one.hatched || other.hatched, filled: Math.min(one.filled, other.filled) };
    if (comparison === null) return { ...there, colour: null };
    if (view.show === "significance") {
      const code = comparison.verdict[index];
      return { ...there, colour: there.filled > 0 ? verdict(code) : null, outlined: true, text: SIGNS[code] };
    }
    const value = comparison.difference[index];
    if (value === null) return { ...there, colour: null };
    return { ...there, colour: diverging(value / most), text: signed(value, view.measure) };
  };
}

/** How much of a cell is there. */
function presence(store, map, index) {
  const runs = map.runs[index];
  const refused = runs > 0 && map.problems[index] === runs;
  const over = store.sweep.state !== "running";
  const planned = store.cells.planned;
  return {
    hatched: refused || (runs === 0 && over),
    // What was stopped shows its values whole: nothing is going to fill the rest.
    filled: refused ? 0 : runs >= planned || (over && runs > 0) ? 1 : runs / planned,
  };
}

/** 0.572 -> ".57", 1 -> "1". */
export function share2(value) {
  if (value === 1) return "1";
  if (value === 0) return "0";
  return value.toFixed(2).replace(/^0/, "");
}

export function short(value) {
  const size = Math.abs(value);
  return size >= 100 ? value.toFixed(0) : size >= 10 ? value.toFixed(1) : size >= 0.1 ? value.toFixed(2) : value.toPrecision(2);
}

function signed(value, measure) {
  const text = measure === "success" ? share2(Math.abs(value)) : short(Math.abs(value));
  return Number(text) === 0 ? "0" : `${value > 0 ? "+" : "−"}${text}`;
}

/** The end of a scale for amounts: a few outliers, of cells with hardly a run, shall not make all others look alike. */
function scaleOf(column) {
  const values = column.filter((value) => value !== null).sort((a, b) => a - b);
  const most = roundUp(values[Math.ceil((values.length - 1) * USUAL_SHARE)] ?? 0);
  return { most, isCut: (values.at(-1) ?? 0) > most };
}

function roundUp(value) {
  if (!(value > 0)) return 1;
  const power = 10 ** Math.floor(Math.log10(value));
  return power * ([1, 1.5, 2, 3, 4, 5, 7.5, 10].find((step) => step * power >= value * 0.999) ?? value / power);
}
