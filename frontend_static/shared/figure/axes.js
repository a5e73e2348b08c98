/** Axes as SVG: lines of the grid behind the traces, numbers and titles around them. They are made anew only when they change. */

import { h, svg } from "../dom.js";
import { LINE } from "./box.js";

/** @import { Box, Furniture } from "./box.js" */
/** @import { Scale } from "./scale.js" */

const TICK = 0.3;

export class Axes {
  /** Behind the traces. */
  grid = svg("svg", { class: "figure-grid", "aria-hidden": "true" });
  /** Around them. */
  texts = h("div", { class: "figure-texts", "aria-hidden": "true" });
  #shown = "";

  /**
   * @param {Box} box
   * @param {{x: Scale, y: Scale}} scales
   * @param {Furniture} around
   * @param {number} aside How far left of the box its title begins, px.
   * @param {number} em
   * @param {boolean} isBare Without lines, where what is drawn has its own.
   */
  show(box, { x, y }, around, aside, em, isBare) {
    const { left, top, width, height } = box;
    const [right, bottom] = [left + width, top + height];
    const down = around.x.map(({ at, text }) => ({ at: Math.round(x.at(at)), text }));
    const across = around.y.map(({ at, text }) => ({ at: Math.round(y.at(at)), text }));
    const now = JSON.stringify([box, down, across, around.below, around.beside, around.lines, aside, em, isBare]);
    if (now === this.#shown) return;
    this.#shown = now;
    const tick = TICK * em;
    const lines = [
      ...down.map(({ at }) => line("grid", at, top, at, bottom)),
      ...across.map(({ at }) => line("grid", left, at, right, at)),
      line("axis", left, bottom, right, bottom),
      line("axis", left, top, left, bottom),
      ...down.map(({ at }) => line("axis", at, bottom, at, bottom + tick)),
      ...across.map(({ at }) => line("axis", left - tick, at, left, at)),
    ];
    this.grid.replaceChildren(...(isBare ? [] : lines));
    const below = bottom + TICK * em;
    const under = down.some(({ text }) => text) ? below + LINE * em : below;
    this.texts.replaceChildren(
      ...down.map(({ at, text }) => words("across", text, { left: at, top: below })),
      ...across.map(({ at, text }) => words("up", text, { left: left - 0.45 * em, top: at })),
      ...(around.below ? [words("below", around.below, { left, top: under, "min-width": width }, `calc(100% - ${left}px)`)] : []),
      ...(around.beside ? [words("beside", around.beside, { left: left - aside, top, height, width: around.lines * LINE * em })] : []),
    );
  }
}

/**
 * On whole pixels, so that it is sharp.
 *
 * @param {string} name
 * @param {number} x1
 * @param {number} y1
 * @param {number} x2
 * @param {number} y2
 */
function line(name, x1, y1, x2, y2) {
  return svg("path", { class: name, d: `M${x1 + 0.5} ${y1 + 0.5}L${x2 + 0.5} ${y2 + 0.5}` });
}

/**
 * @param {string} name
 * @param {string} text
 * @param {Record<string, number>} place px
 * @param {string} [longest] What room there is for it.
 */
function words(name, text, place, longest = "") {
  const element = h("span", { class: `figure-${name}` }, text);
  for (const [side, px] of Object.entries(place)) element.style.setProperty(side, `${px}px`);
  element.style.maxWidth = longest;
  return element;
}
