/**
 * The axes of a panel: where they enclose what is drawn, which of their numbers there is room for, and both on the page. The
 * grid is painted behind the traces; numbers and titles are elements around them.
 */

import { html, render } from "../../vendor/preact.js";
import { Scale, ticksOf, titled } from "./scale.js";

/** @import { Sheet } from "./paint.js" */
/** @import { Tick } from "./scale.js" */
/** @import { Axis, Panel } from "./traces.js" */

/** @typedef {{left: number, top: number, width: number, height: number}} Box px of the page within the panel's plot. */
/** @typedef {{left: number, right: number, bottom: number}} Margins px around the box. */
/** @typedef {{ink: Record<string, string>, em: number, wide: (text: string) => number}} Style Colours; size of the letters and width of a text, px. */

/** The smallest box that is worth painting, px. */
const LEAST = 8;
/** Height of a line of letters, in their size; what follows likewise. */
const LINE = 1.25;
const GAP = 0.45;
/** Above the box: the upper half of a number at its upper end. */
export const TOP = LINE / 2;
const TICK = 0.3;
/** Between two numbers side by side. */
const BESIDE = 0.4;
/** A title beside a lower figure would be a letter and dots. */
const LOWEST = 2.5;
/** Room for one number. */
const APART = { x: 5, y: 1.9 };
/** About what stands beside a box. */
const ASIDE = 4;
/** More numbers than that help nobody. */
const MOST = { x: 11, y: 7 };
/** Margins grow in such steps, so that another digit seldom moves the box. */
const STEP = 0.5;

/**
 * An axis with numbers and without words, as long as nothing else is said.
 *
 * @param {Partial<Axis> & {low: number, high: number}} axis
 * @returns {Axis}
 */
export function plainAxis(axis) {
  return { title: "", unit: "", log: false, names: [], hidden: false, ...axis };
}

/**
 * What stands around a panel's box.
 *
 * @typedef {object} Furniture
 * @property {Tick[]} x
 * @property {Tick[]} y
 * @property {string} below Title of the axis to the right.
 * @property {string} beside Title of the axis upwards.
 * @property {number} lines How many lines of letters that takes.
 */

/**
 * The ticks and titles that there is room for.
 *
 * @param {Panel} panel
 * @param {{width: number, height: number}} room px
 * @param {Pick<Style, "em"|"wide">} style
 * @param {boolean} sharesX Whether a panel below has the same axis and says its numbers.
 * @returns {Furniture}
 */
export function furniture(panel, { width, height }, { em, wide }, sharesX) {
  const count = (/** @type {"x"|"y"} */ along, /** @type {number} */ px) => Math.min(Math.max(2, Math.floor(px / (APART[along] * em))), MOST[along]);
  const ticks = ticksOf(panel.x, count("x", width));
  const { names } = panel.x;
  const numbered = names.length ? everyOther(ticks, (width - ASIDE * em) / names.length, Math.max(...names.map(wide)) + GAP * em) : ticks;
  const x = sharesX ? ticks.map(({ at }) => ({ at, text: "" })) : numbered;
  const left = (/** @type {string} */ below) => height - TOP * em - under({ x, below }, em);
  // Where nothing would be left to paint on, a title gives way.
  const below = sharesX || left(titled(panel.x)) < LEAST ? "" : titled(panel.x);
  const high = left(below);
  const across = ticksOf(panel.y, count("y", high));
  const y = panel.y.names.length ? everyOther(across, high / panel.y.names.length, LINE * em) : across;
  const isBroken = titled(panel.y).split(" ").some((word) => wide(word) > high);
  const beside = isBroken ? panel.y.unit : titled(panel.y);
  return { x, y, below, beside, lines: Number(beside !== "") + Number(wide(beside) > high) };
}

/**
 * Names that stand as far apart as they are long: all, or each second, or third.
 *
 * @param {Tick[]} ticks
 * @param {number} room For each, px.
 * @param {number} needed For each, px.
 */
function everyOther(ticks, room, needed) {
  const every = Math.max(1, Math.ceil(needed / room));
  return ticks.map(({ at, text }, place) => ({ at, text: place % every ? "" : text }));
}

/**
 * Height of what stands below the box, px.
 *
 * @param {Pick<Furniture, "x"|"below">} around
 * @param {number} em
 */
function under({ x, below }, em) {
  return (x.some(({ text }) => text) ? LINE * em + GAP * em : GAP * em) + (below ? LINE * em : 0);
}

/**
 * @param {Furniture} around
 * @param {Pick<Style, "em"|"wide">} style
 * @returns {Margins}
 */
export function margins({ x, y, below, lines }, { em, wide }) {
  const numbers = Math.max(0, ...y.map(({ text }) => wide(text)));
  const [first, last] = [x[0], x[x.length - 1]].map((tick) => (tick ? wide(tick.text) / 2 : 0));
  const step = (/** @type {number} */ px) => Math.ceil(px / (STEP * em)) * STEP * em;
  return {
    left: step(Math.max(lines * LINE * em + (numbers ? numbers + GAP * em : 0) + GAP * em, first)),
    right: step(Math.max(last, GAP * em)),
    bottom: under({ x, below }, em),
  };
}

/**
 * @param {Panel} panel
 * @param {{width: number, height: number}} room px
 * @param {Margins} around
 * @param {number} em
 * @returns {Box}
 */
export function boxOf(panel, { width, height }, { left, right, bottom }, em) {
  const top = TOP * em;
  const [across, up] = [Math.abs(panel.x.high - panel.x.low) || 1, Math.abs(panel.y.high - panel.y.low) || 1];
  const { unit_px: most = Infinity } = panel;
  return {
    left: Math.round(left),
    top: Math.round(top),
    width: Math.round(Math.min(Math.max(LEAST, width - left - right), most * across)),
    height: Math.round(Math.min(Math.max(LEAST, height - top - bottom), most * up)),
  };
}

/**
 * The scales of a panel in its box.
 *
 * @param {{x: Axis, y: Axis}} axes
 * @param {Box} box
 */
export function scales({ x, y }, { left, top, width, height }) {
  return { x: new Scale(x, left, left + width), y: new Scale(y, top + height, top) };
}

/**
 * @param {Sheet} sheet
 * @param {Furniture} around
 * @param {number} em
 */
export function paintGrid({ pen, box, x, y, ink }, around, em) {
  const { left, top, width, height } = box;
  const [right, bottom] = [left + width, top + height];
  const [down, across] = [around.x.map(({ at }) => Math.round(x.at(at))), around.y.map(({ at }) => Math.round(y.at(at)))];
  const tick = TICK * em;
  const draw = (/** @type {string} */ colour, /** @type {number[][]} */ lines) => {
    pen.beginPath();
    // On whole pixels, so that they are sharp.
    for (const [x1, y1, x2, y2] of lines) {
      pen.moveTo(x1 + 0.5, y1 + 0.5);
      pen.lineTo(x2 + 0.5, y2 + 0.5);
    }
    pen.lineWidth = 1;
    pen.strokeStyle = colour;
    pen.stroke();
  };
  draw(ink.line, [...down.map((at) => [at, top, at, bottom]), ...across.map((at) => [left, at, right, at])]);
  const ends = [...down.map((at) => [at, bottom, at, bottom + tick]), ...across.map((at) => [left - tick, at, left, at])];
  draw(ink.edge, [[left, bottom, right, bottom], [left, top, left, bottom], ...ends]);
}

/**
 * Write numbers and titles around a box.
 *
 * @param {Element} root
 * @param {Sheet} sheet
 * @param {Furniture} around
 * @param {number} aside How far left of the box its title begins, px.
 * @param {Pick<Style, "em"|"wide">} style
 */
export function writeAxes(root, { box, x, y }, around, aside, { em, wide }) {
  const { left, top, width, height } = box;
  const below = top + height + TICK * em;
  const numbers = withRoom(around.x.map(({ at, text }) => ({ text, at: Math.round(x.at(at)), size: wide(text) })), BESIDE * em);
  const beside = withRoom(around.y.map(({ at, text }) => ({ text, at: Math.round(y.at(at)), size: LINE * em })), 0);
  const titleTop = numbers.length ? below + LINE * em : below;
  const place = {
    below: { ...inPx({ left, top: titleTop, minWidth: width }), maxWidth: `calc(100% - ${left}px)` },
    beside: inPx({ left: left - aside, top, height, width: around.lines * LINE * em }),
  };
  render(
    [
      ...numbers.map(({ at, text }) => html`<span class="figure-across" style=${inPx({ left: at, top: below })}>${text}</span>`),
      ...beside.map(({ at, text }) => html`<span class="figure-up" style=${inPx({ left: left - GAP * em, top: at })}>${text}</span>`),
      around.below && html`<span class="figure-below" style=${place.below}>${around.below}</span>`,
      around.beside && height >= LOWEST * em && html`<span class="figure-beside" style=${place.beside}>${around.beside}</span>`,
    ],
    root,
  );
}

/** @param {Record<string, number>} lengths */
function inPx(lengths) {
  return Object.fromEntries(Object.entries(lengths).map(([name, length]) => [name, `${length}px`]));
}

/**
 * Labels that stand in no other's place. The ends stay, which say most.
 *
 * @param {{text: string, at: number, size: number}[]} labels
 * @param {number} gap At least between two, px.
 */
export function withRoom(labels, gap) {
  const shown = labels.filter(({ text }) => text !== "").sort((one, other) => one.at - other.at);
  const last = shown.at(-1);
  let end = -Infinity;
  return shown.filter((label) => {
    const [from, to] = [label.at - label.size / 2, label.at + label.size / 2];
    const isFree = from >= end + gap && (last === undefined || label === last || to + gap <= last.at - last.size / 2);
    if (isFree) end = to;
    return isFree;
  });
}

/**
 * Whether two axes are the same for who reads them.
 *
 * @param {Axis} one
 * @param {Axis} other
 */
export function isSame(one, other) {
  return JSON.stringify(one) === JSON.stringify(other);
}
