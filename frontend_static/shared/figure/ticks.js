/** Where the numbers of an axis stand, and how they are written. */

/** @import { Axis } from "./traces.js" */

/** @typedef {{at: number, text: string}} Tick */

const STEPS = [1, 2, 5, 10, 20, 50, 100];
/** Multiples of a power of ten between which logarithmic axes of few decades are divided. */
const WITHIN_DECADE = [[1, 2, 3, 4, 5, 6, 7, 8, 9], [1, 2, 5], [1, 3], [1]];
/** From so many digits on before the decimal point, or zeros behind it, a number is written with a power of ten. */
const [MOST_DIGITS, MOST_ZEROS] = [6, 4];
/** Ends of an axis are reached in spite of rounding. */
const SLACK = 1e-9;
const RAISED = "⁰¹²³⁴⁵⁶⁷⁸⁹";
/** How numbers are written, by their decimals: to make a format takes longer than to use it a hundred times.
 *
 * @type {Map<string, Intl.NumberFormat>} */
const FORMATS = new Map();

/**
 * The ticks of an axis.
 *
 * @param {Axis} axis
 * @param {number} most How many there is room for.
 * @returns {Tick[]}
 */
export function ticksOf(axis, most) {
  if (axis.hidden) return [];
  if (axis.ticks) return axis.ticks;
  if (axis.names.length) return named(axis);
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
export function even({ low, high }, most) {
  const [least, greatest] = low <= high ? [low, high] : [high, low];
  const power = 10 ** Math.floor(Math.log10((greatest - least || 1) / (most + 1)));
  const grids = STEPS.map((each) => multiples(each * power, least, greatest));
  const found = grids.findIndex(({ values }) => values.length <= most);
  const [before, grid] = [grids[found - 1], grids[found]];
  // One number alone says nothing: rather one too many.
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
  for (const factors of WITHIN_DECADE) {
    const values = powers.flatMap((power) => factors.map((each) => each * 10 ** power)).filter(isOn);
    if (values.length <= most) return values;
  }
  const every = Math.ceil(powers.length / most);
  return powers.filter((power) => power % every === 0).map((power) => 10 ** power).filter(isOn);
}

/** @param {Axis} axis */
function named({ names, low, high }) {
  return names.map((text, at) => ({ at, text })).filter(({ at }) => at >= Math.min(low, high) && at <= Math.max(low, high));
}

/**
 * A number as it stands at an axis: "−0.5", "20,000", "3×10⁻⁶".
 *
 * @param {number} value
 * @param {number} [decimals] As many as it needs if none are given.
 */
export function written(value, decimals) {
  const power = value === 0 ? 0 : Math.floor(Math.log10(Math.abs(value)) + SLACK);
  if (power >= MOST_DIGITS || power < -MOST_ZEROS) return scientific(value, power);
  const digits = decimals ?? Math.max(0, Math.min(MOST_ZEROS, 2) - power);
  return format(decimals ?? 0, Math.min(digits, 20)).format(value).replace("-", "−");
}

/**
 * @param {number} least Decimals.
 * @param {number} most
 */
function format(least, most) {
  const name = `${least} ${most}`;
  const known = FORMATS.get(name);
  if (known !== undefined) return known;
  const made = new Intl.NumberFormat("en-GB", { minimumFractionDigits: least, maximumFractionDigits: most });
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
