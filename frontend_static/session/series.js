/**
 * Series: what tracker and experiment measure of every frame. General code finds them by role or by the name that a plot
 * declares; a row has only those that its tracker reports.
 */

/** @import { Series } from "../shared/messages.js" */
/** @import { History, Row } from "./history.js" */

/** @typedef {{series: readonly Series[]}} Declaring What declares series, such as a session. */
/** @typedef {Series["role"]} Role */
/** @typedef {{values: (number|null)[][], weights: (number|null)[], parents?: number[]}} Hypotheses Row i has weight i and parent i. */
/** @typedef {number|null|(number|null)[]|Hypotheses} SeriesValue By its shape: a number, a vector or interval, hypotheses. */

/**
 * The declaration of a series; undefined where nobody declares one of that name.
 *
 * @param {Declaring} session
 * @param {string} name
 */
export function declared(session, name) {
  return session.series.find((series) => series.name === name);
}

/**
 * The declarations of a role.
 *
 * @param {Declaring} session
 * @param {Role} role
 */
export function ofRole(session, role) {
  return session.series.filter((series) => series.role === role);
}

/**
 * What a row has of a role: the value of the first series of it, or undefined.
 *
 * @param {Declaring} session
 * @param {Role} role
 * @param {Row|undefined} row
 */
export function measured(session, role, row) {
  const values = ofRole(session, role).map(({ name }) => row?.series?.[name]);
  return values.find((value) => value !== undefined);
}

/**
 * A vector or an interval of a frame; empty where the frame has none.
 *
 * @param {Row|undefined} row
 * @param {string} name
 */
export function vectorOf(row, name) {
  const value = row?.series?.[name];
  return Array.isArray(value) ? value : [];
}

/**
 * The hypotheses of a frame; undefined where the frame has none.
 *
 * @param {Row|undefined} row
 * @param {string} name
 */
export function hypothesesOf(row, name) {
  const value = row?.series?.[name];
  return isHypotheses(value) ? value : undefined;
}

/**
 * A number of a series in a frame, or the one at a place of several; NaN where it is not known.
 *
 * @param {Row|undefined} row
 * @param {string} name
 * @param {number|null} [place]
 */
export function valueOf(row, name, place = null) {
  return finite(place === null ? row?.series?.[name] : vectorOf(row, name)[place]) ?? NaN;
}

/**
 * The number that a row has of a role; null where there is none.
 *
 * @param {Declaring} session
 * @param {Role} role
 * @param {Row|undefined} row
 */
export function numberOf(session, role, row) {
  return finite(measured(session, role, row));
}

/**
 * How many particles came from each sampler; null where the tracker does not choose between samplers.
 *
 * @param {Declaring} session
 * @param {Row|undefined} row
 */
export function samplesOf(session, row) {
  const counts = measured(session, "share", row);
  return Array.isArray(counts) ? counts.map((count) => count ?? 0) : null;
}

/**
 * The components of what `samplesOf` counts, the colours as tokens of the style sheet.
 *
 * @param {Declaring} session
 */
export function samplers(session) {
  const [series] = ofRole(session, "share");
  return (series?.components ?? []).map((name, place) => ({ name, colour: series.colours[place] ?? "muted" }));
}

/**
 * What happened in a frame, in the order in which it is declared; `lane` is the place among all that may happen.
 *
 * @param {Declaring} session
 * @param {Row|undefined} row
 */
export function eventsOf(session, row) {
  return ofRole(session, "event")
    .map(({ name, title, colours }, lane) => ({ name, title, colour: colours[0] ?? "ink", lane }))
    .filter(({ name }) => valueOf(row, name) > 0);
}

/**
 * The frames in which something has happened, in rising order; of a run the same event in frames that follow each other once.
 *
 * @param {{known: Declaring, history: History}} run
 */
export function eventFramesOf({ known, history }) {
  /** @type {number[]} */
  const frames = [];
  let before = "";
  for (let frame = 0; frame < history.length; frame += 1) {
    const names = eventsOf(known, history.at(frame)).map(({ name }) => name).join(" ");
    if (names !== "" && names !== before) frames.push(frame);
    before = names;
  }
  return frames;
}

/**
 * Of flags, the share that were set up to each frame; NaN before any is known.
 *
 * @param {History} history
 * @param {string} name
 * @param {number} [last]
 */
export function frequencies(history, name, last = history.length - 1) {
  /** @type {number[]} */
  const found = [];
  let [set, known] = [0, 0];
  for (let frame = 0; frame <= Math.min(last, history.length - 1); frame += 1) {
    const value = history.at(frame)?.series?.[name] ?? [];
    for (const each of Array.isArray(value) ? value : [value]) {
      const flag = finite(each);
      if (flag === null) continue;
      set += flag;
      known += 1;
    }
    found.push(known > 0 ? set / known : NaN);
  }
  return found;
}

/**
 * Whether a value says anything: a number, or several of which one is known.
 *
 * @param {SeriesValue} value
 * @returns {boolean}
 */
export function isKnown(value) {
  if (Array.isArray(value)) return value.some(isKnown);
  return isHypotheses(value) ? value.values.length > 0 : finite(value) !== null;
}

/**
 * @param {SeriesValue|undefined} value
 * @returns {value is Hypotheses}
 */
function isHypotheses(value) {
  return typeof value === "object" && value !== null && "weights" in value;
}

/**
 * @param {unknown} value
 * @returns {number|null}
 */
function finite(value) {
  return typeof value === "number" && Number.isFinite(value) ? value : null;
}
