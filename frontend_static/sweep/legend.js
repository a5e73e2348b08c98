/** What the colours mean. */

import { fill, h } from "../shared/dom.js";
import { onTheme } from "../shared/theme.js";
import { css, diverging, gradient, verdict, viridis } from "../shared/colours.js";
import { differenceEnd, errorEnd, measureEnd, short } from "./cell_style.js";

/** @import { CellsPublic } from "../shared/messages.js" */
/** @import { SweepStore } from "./store.js" */

/**
 * @param {HTMLElement} root
 * @param {SweepStore} store
 */
export function legend(root, store) {
  const draw = () => store.cells !== null && fill(root, amounts(store, store.cells), store.compares && comparison(store), presence(store));
  store.on(["sweep", "cells", "view", "comparison"], draw);
  onTheme(draw);
}

/**
 * @param {SweepStore} store
 * @param {CellsPublic} cells
 */
function amounts({ quantity, measure, known }, cells) {
  if (measure !== undefined) {
    const { most, words } = measureEnd(cells, measure);
    const unit = measure.unit ? ` ${measure.unit}` : "";
    const [none, all] = measure.how === "share" ? ["0", "1"] : [`0${unit}`, `${short(most)}${unit}${words}`];
    const [worse, better] = measure.better === "higher" ? [none, all] : [all, none];
    return scale(`${measure.title}, mean of all runs`, gradient(viridis), worse, better);
  }
  if (quantity === "success") return scale("Success rate", gradient(viridis), "0", "1");
  const unit = known.unit ? ` ${known.unit}` : "";
  const { most, words } = errorEnd(cells);
  return scale("Mean error", gradient(viridis), `${short(most)}${unit}${words}`, `0${unit}`);
}

/** @param {SweepStore} store */
function comparison(store) {
  const { view, known, quantity, measure } = store;
  const [first, second] = [view.first, view.second].map((id) => store.shortOf(id));
  if (view.show === "difference") {
    const { most, words } = differenceEnd(store);
    const name = measure?.unit ?? (quantity === "error" ? known.unit : "");
    const unit = name && ` ${name}`;
    return scale("Difference", gradient((share) => diverging(-share), -1), `${first} better by ${short(most)}${unit}${words}`, `${second} better`);
  }
  return [
    key(css(verdict("first")), `${first} better`),
    key(css(verdict("second")), `${second} better`),
    key(css(verdict("none")), "not significant"),
    key(css(verdict("untested")), "not applicable"),
  ];
}

/** @param {SweepStore} store */
function presence({ known }) {
  return [
    known.state === "running" && h("span", { class: "legend-key" }, h("span", { class: "swatch pending" }), "to come"),
    h("span", { class: "legend-key" }, h("span", { class: "swatch hatched" }), "not tested"),
  ];
}

/**
 * @param {string} name
 * @param {string} background
 * @param {string} low
 * @param {string} high
 */
function scale(name, background, low, high) {
  const bar = h("span", { class: "legend-bar", role: "img", "aria-label": `Colours from ${low} to ${high}` });
  bar.style.background = background;
  return h("span", { class: "legend-key" }, h("strong", {}, name), low, bar, high);
}

/**
 * @param {string} background
 * @param {string} words
 */
function key(background, words) {
  const swatch = h("span", { class: "swatch" });
  swatch.style.background = background;
  return h("span", { class: "legend-key" }, swatch, words);
}
