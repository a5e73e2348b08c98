/** Axes as SVG: lines of the grid behind the traces, numbers and titles around them. They are made anew only when they change. */

import { h, svg } from "../dom.js";
import { LINE } from "./box.js";

/** @import { Box, Furniture } from "./box.js" */
/** @import { Scale } from "./scale.js" */

const TICK = 0.3;
/** A title beside a lower figure would be a letter and dots, in heights of a letter. */
const LOWEST = 2.5;
/** Between two numbers side by side, in heights of a letter. */
const APART = 0.4;

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
    const numbers = down.map(({ at, text }) => words("across", text, { left: at, top: below }));
    const beside = across.map(({ at, text }) => words("up", text, { left: left - 0.45 * em, top: at }));
    this.texts.replaceChildren(
      ...numbers,
      ...beside,
      ...(around.below ? [words("below", around.below, { left, top: under, "min-width": width }, `calc(100% - ${left}px)`)] : []),
      ...(around.beside && height >= LOWEST * em ? [words("beside", around.beside, { left: left - aside, top, height, width: around.lines * LINE * em })] : []),
    );
    keepApart(numbers, "left", "right", APART * em);
    keepApart(beside, "top", "bottom", 0);
  }
}

/**
 * Leave out what would stand in another's place. The ends stay, which say most.
 *
 * @param {HTMLElement[]} labels
 * @param {"left"|"top"} from
 * @param {"right"|"bottom"} to
 * @param {number} gap At least between two, px.
 */
function keepApart(labels, from, to, gap) {
  const shown = labels.filter(({ textContent }) => textContent !== "").map((label) => ({ label, box: label.getBoundingClientRect() }));
  shown.sort((one, other) => one.box[from] - other.box[from]);
  const last = shown.at(-1);
  let end = -Infinity;
  for (const one of shown) {
    const isHit = one.box[from] < end + gap || (one !== last && last !== undefined && one.box[to] + gap > last.box[from]);
    one.label.hidden = isHit && one.box[to] > one.box[from];
    if (!one.label.hidden) end = one.box[to];
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
