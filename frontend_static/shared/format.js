/** Numbers and words for people. Every figure has a unit. */

const MISSING = "–";

/** Decimals of quantities, by unit: frames are counted, pure numbers mostly lie between 0 and 1. */
const DECIMALS = new Map([["", 3], ["frames", 0]]);

/** Pure numbers above this are counts, those below mostly shares. */
const COUNTED = 10;

/** A number with some decimals; a dash if there is none.
 *
 * @param {unknown} value
 * @param {number} [decimals]
 */
export function number(value, decimals = 1) {
  return typeof value === "number" && Number.isFinite(value) ? value.toFixed(decimals) : MISSING;
}

/**
 * A number of a session's quantities: pixels to a tenth, signals to a thousandth, frames and counts as whole numbers.
 *
 * @param {unknown} value
 * @param {string} unit
 */
export function quantity(value, unit) {
  const counted = unit === "" && Number.isInteger(value) && Math.abs(Number(value)) > 1;
  return number(value, counted ? 0 : DECIMALS.get(unit) ?? 1);
}

/** The smallest span of an axis: values below a pixel, or below one for counts, shall not look large.
 *
 * @param {string} unit
 * @param {number} [most] The largest value.
 */
export function smallestSpan(unit, most = 0) {
  return unit !== "" || most > COUNTED ? 1 : 0.01;
}

/** @typedef {boolean|number|string} Value A parameter's value. */

/** A parameter's value in its shortest exact form.
 *
 * @param {Value} value
 * @param {{unit: string, kind?: string}|null} [declaration]
 */
export function parameterValue(value, declaration) {
  if (declaration?.kind === "file") return value === "" ? "none" : "own file";
  const text = typeof value === "number" ? String(Number(value.toPrecision(6))) : String(value);
  return declaration?.unit ? `${text} ${declaration.unit}` : text;
}

/** A measure of a whole run: a share in percent, a number of frames with the total, anything else with its unit.
 *
 * @param {number|null} value
 * @param {{how: string, unit: string}} measure
 * @param {number} [frames] Frames of the run.
 */
export function measureValue(value, { how, unit }, frames) {
  if (value === null) return MISSING;
  if (how === "share") return `${number(100 * value, 0)} %`;
  if (how === "until") return frames === undefined ? `${number(value, 0)} ${unit}` : `${number(value, 0)} of ${frames}`;
  return unit === "" ? number(value, 2) : `${number(value)} ${unit}`;
}

/**
 * 12,345,678 bytes -> "12.3 MB".
 *
 * @param {number} amount
 */
export function bytes(amount) {
  const units = ["B", "kB", "MB", "GB"];
  const unit = Math.max(0, units.findLastIndex((_, place) => amount >= 1000 ** place));
  const value = amount / 1000 ** unit;
  return `${value.toFixed(value >= 100 || unit === 0 ? 0 : 1)} ${units[unit]}`;
}

/**
 * 0.1 -> "0.1×"; 0 -> "max".
 *
 * @param {number} value
 */
export function speed(value) {
  return value === 0 ? "max" : `${Number(value.toPrecision(3))}×`;
}

/**
 * 0.62 -> "62 %".
 *
 * @param {number} share
 */
export function percent(share) {
  return `${Math.round(100 * share)} %`;
}

/** A time, as "today, 14:03" or "3 Mar 2026, 14:03".
 *
 * @param {string} text Time in ISO 8601.
 */
export function moment(text) {
  const date = new Date(text);
  if (Number.isNaN(date.getTime())) return "";
  const time = date.toLocaleTimeString("en-GB", { hour: "2-digit", minute: "2-digit" });
  if (date.toDateString() === new Date().toDateString()) return `today, ${time}`;
  return `${date.toLocaleDateString("en-GB", { day: "numeric", month: "short", year: "numeric" })}, ${time}`;
}

/**
 * "1 frame", "2 frames".
 *
 * @param {number} amount
 * @param {string} noun
 */
export function count(amount, noun) {
  return `${amount.toLocaleString("en-GB")} ${noun}${amount === 1 ? "" : "s"}`;
}

/**
 * 75 -> "1 min 15 s".
 *
 * @param {number|null} seconds
 */
export function duration(seconds) {
  if (seconds === null) return "–";
  if (seconds < 60) return `${Math.max(1, Math.round(seconds))} s`;
  const minutes = Math.floor(Math.round(seconds) / 60);
  if (minutes < 10) return `${minutes} min ${Math.round(seconds) % 60} s`;
  if (minutes < 120) return `${minutes} min`;
  return `${(seconds / 3600).toFixed(1)} h`;
}
