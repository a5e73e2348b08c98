/** The axes of a panel: their box, the numbers for which there is room, and both on the page. The grid is painted behind the traces;
 * numbers and titles are elements around them.
 */

import { html, render } from "../../vendor/preact.js";

/** @import { Sheet } from "./paint.js" */
/** @import { Axis, Panel, Trace } from "./traces.js" */

// From values of an axis to px of a panel and back, the places of its numbers, and values in words.

/** @typedef {{at: number, text: string}} Tick */

/** Largest coordinate, px; beyond it browsers become slow. */
const FAR_PX = 30_000;
const STEPS = [1, 2, 5, 10, 20, 50, 100];
/** Multiples of a power of ten between which logarithmic axes of few decades are divided. */
const WITHIN_DECADE = [[1, 2, 3, 4, 5, 6, 7, 8, 9], [1, 2, 5], [1, 3], [1]];
/** Digits before the decimal point, or zeros after it, from which a number is written with a power of ten. */
const [MOST_DIGITS, MOST_ZEROS] = [6, 4];
/** Tolerance with which ends of an axis are reached in spite of rounding. */
const SLACK = 1e-9;
const RAISED = "⁰¹²³⁴⁵⁶⁷⁸⁹";
/** Number of distinguishable steps on an axis. */
const DIGITS = 3;
const MOST_DECIMALS = 12;
/** Cached number formats by decimals: making a format takes longer than using it a hundred times.
 *
 * @type {Map<string, Intl.NumberFormat>}
 */
const FORMATS = new Map();

export class Scale {
  #start;
  #rate;
  #from;
  #log;

  /**
   * @param {Pick<Axis, "low"|"high"|"log">} axis A logarithmic one begins above 0.
   * @param {number} from px of the lowest value.
   * @param {number} to px of the highest value.
   */
  constructor({ low, high, log }, from, to) {
    this.low = low;
    this.high = high;
    this.#log = log;
    this.#from = from;
    this.#start = this.#bent(low);
    const span = this.#bent(high) - this.#start;
    this.#rate = (to - from) / (span || 1);
  }

  /** @param {number|null} value A gap stays one: NaN. */
  at(value) {
    if (value === null) return NaN;
    const px = this.#from + (this.#bent(value) - this.#start) * this.#rate;
    return Math.min(Math.max(px, -FAR_PX), FAR_PX);
  }

  /** @param {number} px */
  value(px) {
    const bent = this.#start + (px - this.#from) / this.#rate;
    return this.#log ? 10 ** bent : bent;
  }

  /**
   * All of a trace's values at once.
   *
   * @param {readonly (number|null)[]} values
   */
  all(values) {
    const places = new Float64Array(values.length);
    for (let index = 0; index < values.length; index += 1) places[index] = this.at(values[index]);
    return places;
  }

  /** All values of a trace, with gaps also for values beyond the axis.
   *
   * @param {readonly (number|null)[]} values
   */
  held(values) {
    const [least, greatest] = ends(this);
    return this.all(values.map((value) => (value !== null && (value < least || value > greatest) ? null : value)));
  }

  /** The value from which bars and stems rise: 0, or the end of the axis that is nearest to it. */
  get ground() {
    const [least, greatest] = ends(this);
    return this.#log ? least : Math.min(Math.max(0, least), greatest);
  }

  /** @param {number} value */
  #bent(value) {
    if (!this.#log) return value;
    // Zero is below every value: bars and curves rise from the bottom.
    return value > 0 ? Math.log10(value) : -Infinity;
  }
}

/**
 * The least and the greatest value of an axis, whichever way it goes.
 *
 * @param {{low: number, high: number}} axis
 */
export function ends({ low, high }) {
  return low <= high ? [low, high] : [high, low];
}

/**
 * The ticks of an axis.
 *
 * @param {Axis} axis
 * @param {number} most Most ticks that there is room for.
 * @returns {Tick[]}
 */
export function ticksOf(axis, most) {
  if (axis.hidden) return [];
  if (axis.ticks) return axis.ticks;
  const [least, greatest] = ends(axis);
  if (axis.names.length) return axis.names.map((text, at) => ({ at, text })).filter(({ at }) => at >= least && at <= greatest);
  if (axis.log) return logarithmic(axis, most).map((at) => ({ at, text: written(at) }));
  const { step, values } = even(axis, most);
  const decimals = Math.max(0, -Math.floor(Math.log10(step) + SLACK));
  return values.map((at) => ({ at, text: written(at, decimals) }));
}

/**
 * Multiples of 1, 2 or 5 times a power of ten.
 *
 * @param {{low: number, high: number}} axis
 * @param {number} most
 */
export function even(axis, most) {
  const [least, greatest] = ends(axis);
  const power = 10 ** Math.floor(Math.log10((greatest - least || 1) / (most + 1)));
  const grids = STEPS.map((each) => multiples(each * power, least, greatest));
  const found = grids.findIndex(({ values }) => values.length <= most);
  const [before, grid] = [grids[found - 1], grids[found]];
  // A single number is not enough; rather one too many.
  return grid.values.length < 2 && before?.values.length === most + 1 ? before : grid;
}

/**
 * @param {number} step
 * @param {number} least
 * @param {number} greatest
 */
function multiples(step, least, greatest) {
  const first = Math.ceil(least / step - SLACK);
  const last = Math.floor(greatest / step + SLACK);
  // Products, not sums: 3 * 0.1 is nearer to 0.3 than 0.1 + 0.1 + 0.1.
  const values = Array.from({ length: Math.max(0, last - first + 1) }, (_, index) => (first + index) * step || 0);
  return { step, values };
}

/**
 * Powers of ten, with multiples between them where these are few.
 *
 * @param {{low: number, high: number}} axis
 * @param {number} most
 */
function logarithmic({ low, high }, most) {
  const [first, last] = [Math.floor(Math.log10(low) + SLACK), Math.ceil(Math.log10(high) - SLACK)];
  const powers = Array.from({ length: last - first + 1 }, (_, index) => first + index);
  const isOn = (/** @type {number} */ value) => value >= low * (1 - SLACK) && value <= high * (1 + SLACK);
  const grids = WITHIN_DECADE.map((factors) => powers.flatMap((power) => factors.map((each) => each * 10 ** power)).filter(isOn));
  const every = Math.ceil(powers.length / most);
  const sparse = powers.filter((power) => power % every === 0).map((power) => 10 ** power).filter(isOn);
  return grids.find((values) => values.length <= most) ?? sparse;
}

/** A number at an axis: "−0.5", "20,000", "3×10⁻⁶".
 *
 * @param {number} value
 * @param {number} [decimals] By default as many as it needs.
 */
export function written(value, decimals) {
  const power = value === 0 ? 0 : Math.floor(Math.log10(Math.abs(value)) + SLACK);
  if (power >= MOST_DIGITS || power < -MOST_ZEROS) return scientific(value, power);
  const digits = decimals ?? Math.max(0, Math.min(MOST_ZEROS, 2) - power);
  return format(decimals ?? 0, Math.min(digits, 20)).format(value).replace("-", "−");
}

/**
 * @param {number} least Least number of decimals.
 * @param {number} most
 */
function format(least, most) {
  const name = `${least} ${most}`;
  const made = FORMATS.get(name) ?? new Intl.NumberFormat("en-GB", { minimumFractionDigits: least, maximumFractionDigits: most });
  FORMATS.set(name, made);
  return made;
}

/**
 * @param {number} value
 * @param {number} power
 */
function scientific(value, power) {
  const factor = Number((Math.abs(value) / 10 ** power).toPrecision(3));
  const raised = [...String(Math.abs(power))].map((digit) => RAISED[Number(digit)]).join("");
  const ten = `10${power < 0 ? "⁻" : ""}${raised}`;
  return `${value < 0 ? "−" : ""}${factor === 1 ? ten : `${factor}×${ten}`}`;
}

/**
 * "position, m"
 *
 * @param {Axis} axis
 */
export function titled({ title, unit }) {
  return title && unit ? `${title}, ${unit}` : title || unit;
}

/** "4.40 m": to a thousandth of the axis, or to three digits if it is logarithmic.
 *
 * @param {Axis} axis
 * @param {number} value
 * @param {number} [step] Step of its control: it is not shown more finely.
 */
export function valueOn(axis, value, step) {
  if (axis.names.length) return axis.names[Math.min(Math.max(Math.round(value), 0), axis.names.length - 1)];
  const size = axis.log ? Math.abs(value) : Math.abs(axis.high - axis.low);
  const decimals = Math.max(0, DIGITS - Math.round(Math.log10(size || 1)));
  const text = written(value, step === undefined ? decimals : Math.min(decimals, decimalsOf(step)));
  return axis.unit ? `${text} ${axis.unit}` : text;
}

/**
 * 0.25 -> 2
 *
 * @param {number} step
 */
function decimalsOf(step) {
  return step.toFixed(MOST_DECIMALS).replace(/0+$/, "").split(".")[1].length;
}

/** "position 4.40 m"; only the value if the axis has no title.
 *
 * @param {Axis} axis
 * @param {number} value
 */
export function named(axis, value) {
  return `${axis.title} ${valueOn(axis, value)}`.trim();
}

/** A trace's title before its text.
 *
 * @param {Trace} trace
 * @param {...string} parts
 */
export function saying({ title }, ...parts) {
  return [title, ...parts].filter(Boolean).join(" · ");
}

/** The content of a panel in words, for screen readers.
 *
 * @param {Panel} panel
 * @param {string} [mark] Text of its mark.
 */
export function describe(panel, mark = "") {
  const drawn = [...new Set(panel.traces.map(({ kind, title }) => (title ? `${title} (${kind})` : kind)))];
  const axes = [axisWords("to the right", panel.x), axisWords("upwards", panel.y)];
  return [panel.title, panel.words, mark, drawn.length ? `Drawn: ${drawn.join(", ")}` : "", ...axes].map(sentence).filter(Boolean).join(" ");
}

/**
 * @param {string} way
 * @param {Axis} axis
 */
function axisWords(way, axis) {
  if (!axis.title) return "";
  if (axis.hidden) return `${axis.title} ${way}`;
  return `${titled(axis)} ${way}, from ${valueOn(axis, axis.low)} to ${valueOn(axis, axis.high)}`;
}

/** @param {string} text */
function sentence(text) {
  const whole = text.trim();
  return whole === "" || /[.!?]$/.test(whole) ? whole : `${whole}.`;
}

/** @typedef {{left: number, top: number, width: number, height: number}} Box px of the page within the panel's plot. */
/** @typedef {{left: number, right: number, bottom: number}} Margins px around the box. */
/** @typedef {{ink: Record<string, string>, em: number, wide: (text: string) => number}} Style Colours; size of the letters and width of a text, px. */

/** The smallest box that is worth painting, px. */
const LEAST = 8;
/** Height of a line of letters, in their size; likewise below. */
const LINE = 1.25;
const GAP = 0.45;
/** Room above the box for the upper half of a number at its upper end. */
export const TOP = LINE / 2;
const TICK = 0.3;
/** Gap between two numbers side by side. */
const BESIDE = 0.4;
/** Least height for a title at the side: in a lower figure it would be cut to a letter. */
const LOWEST = 2.5;
/** Room for one number. */
const APART = { x: 5, y: 1.9 };
/** Most numbers on an axis. */
const MOST = { x: 11, y: 7 };
/** Step of margins, so that another digit seldom moves the box. */
const STEP = 0.5;

/** An axis with numbers and without words, by default.
 *
 * @param {Partial<Axis> & {low: number, high: number}} axis
 * @returns {Axis}
 */
export function plainAxis(axis) {
  return { title: "", unit: "", log: false, names: [], hidden: false, ...axis };
}

/** The labels around a panel's box.
 *
 * @typedef {object} Furniture
 * @property {Tick[]} x
 * @property {Tick[]} y
 * @property {string} below Title of the x axis.
 * @property {string} beside Title of the y axis.
 * @property {number} lines Number of its lines.
 */

/** The ticks and titles for which there is room.
 *
 * @param {Panel} panel
 * @param {{width: number, height: number}} room px
 * @param {Pick<Style, "em"|"wide">} style
 * @param {boolean} sharesX Whether a panel below has the same axis with its numbers.
 * @returns {Furniture}
 */
export function furniture(panel, { width, height }, { em, wide }, sharesX) {
  const count = (/** @type {"x"|"y"} */ along, /** @type {number} */ px) => Math.min(Math.max(2, Math.floor(px / (APART[along] * em))), MOST[along]);
  const ticks = ticksOf(panel.x, count("x", width));
  const x = sharesX ? ticks.map(({ at }) => ({ at, text: "" })) : ticks;
  const left = (/** @type {string} */ below) => height - TOP * em - under({ x, below }, em);
  // If no room would be left to paint on, the title is dropped.
  const below = sharesX || left(titled(panel.x)) < LEAST ? "" : titled(panel.x);
  const high = left(below);
  const isBroken = titled(panel.y).split(" ").some((word) => wide(word) > high);
  const beside = isBroken ? panel.y.unit : titled(panel.y);
  return { x, y: ticksOf(panel.y, count("y", high)), below, beside, lines: Number(beside !== "") + Number(wide(beside) > high) };
}

/** Height of the labels below the box, px.
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
  const marks = [...down.map((at) => [at, bottom, at, bottom + tick]), ...across.map((at) => [left - tick, at, left, at])];
  draw(ink.edge, [[left, bottom, right, bottom], [left, top, left, bottom], ...marks]);
}

/**
 * Write numbers and titles around a box.
 *
 * @param {Element} root
 * @param {Sheet} sheet
 * @param {Furniture} around
 * @param {number} aside Distance of the title's left edge from the box, px.
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
export function inPx(lengths) {
  return Object.fromEntries(Object.entries(lengths).map(([name, length]) => [name, `${length}px`]));
}

/** Labels that do not overlap. Those at the ends are kept first.
 *
 * @param {{text: string, at: number, size: number}[]} labels
 * @param {number} gap Least gap between two labels, px.
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
