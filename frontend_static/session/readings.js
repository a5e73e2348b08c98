/** One frame in words: the lines that the experiment declares, and the verdict on the run. The box of numbers and the text for screen
 * readers share them.
 */

import { number, quantity } from "../shared/format.js";
import { curve, isGone } from "./store.js";

/** @import { Reading, Series, SessionPublic } from "../shared/messages.js" */
/** @import { History, Row } from "./store.js" */

// Series: measurements of tracker and experiment in every frame. General code finds them by role or by the name in a plot; a row has only
// the series that its tracker reports.

/** @typedef {{series: readonly Series[]}} Declaring What declares series, such as a session. */
/** @typedef {Series["role"]} Role */
/** @typedef {{values: (number|null)[][], weights: (number|null)[], parents?: number[]}} Hypotheses Row i has weight i and parent i. */
/** @typedef {number|null|(number|null)[]|Hypotheses} SeriesValue By its shape: a number, a vector or interval, hypotheses. */

/** The declaration of a series; undefined if none has this name.
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

/** A row's value of a role: that of the role's first series, or undefined.
 *
 * @param {Declaring} session
 * @param {Role} role
 * @param {Row|undefined} row
 */
export function measured(session, role, row) {
  const values = ofRole(session, role).map(({ name }) => row?.series?.[name]);
  return values.find((value) => value !== undefined);
}

/** A vector or an interval of a frame; empty if the frame has none.
 *
 * @param {Row|undefined} row
 * @param {string} name
 */
function vectorOf(row, name) {
  const value = row?.series?.[name];
  return Array.isArray(value) ? value : [];
}

/** The hypotheses of a frame; undefined if the frame has none.
 *
 * @param {Row|undefined} row
 * @param {string} name
 */
export function hypothesesOf(row, name) {
  const value = row?.series?.[name];
  return isHypotheses(value) ? value : undefined;
}

/** A number of a series in a frame, or the one at an index of a vector; NaN if unknown.
 *
 * @param {Row|undefined} row
 * @param {string} name
 * @param {number|null} [place]
 */
export function valueOf(row, name, place = null) {
  return finite(place === null ? row?.series?.[name] : vectorOf(row, name)[place]) ?? NaN;
}

/** A row's number of a role; null if there is none.
 *
 * @param {Declaring} session
 * @param {Role} role
 * @param {Row|undefined} row
 */
export function numberOf(session, role, row) {
  return finite(measured(session, role, row));
}

/** The number of particles from each sampler; null if the tracker does not choose between samplers.
 *
 * @param {Declaring} session
 * @param {Row|undefined} row
 */
export function samplesOf(session, row) {
  const counts = measured(session, "share", row);
  return Array.isArray(counts) ? counts.map((count) => count ?? 0) : null;
}

/** The components counted by `samplesOf`, with colours as tokens of the style sheet.
 *
 * @param {Declaring} session
 */
export function samplers(session) {
  const [series] = ofRole(session, "share");
  return (series?.components ?? []).map((name, place) => ({ name, colour: series.colours[place] ?? "muted" }));
}

/** The events of a frame, in order of declaration.
 *
 * @param {Declaring} session
 * @param {Row|undefined} row
 */
export function eventsOf(session, row) {
  return ofRole(session, "event").filter(({ name }) => valueOf(row, name) > 0);
}

/** The frames with an event, in rising order; the same event in consecutive frames counts once.
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

/** The share of set flags up to each frame; NaN before any is known.
 *
 * @param {History} history
 * @param {string} name
 */
export function frequencies(history, name) {
  let [set, known] = [0, 0];
  return Array.from({ length: history.length }, (_, frame) => {
    for (const flag of [history.at(frame)?.series?.[name]].flat().map(finite)) {
      set += flag ?? 0;
      known += Number(flag !== null);
    }
    return known > 0 ? set / known : NaN;
  });
}

/** Whether a value is a known number, or contains one.
 *
 * @param {SeriesValue|undefined} value
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
 * @returns {number|null} Null if it is not a finite number.
 */
export function finite(value) {
  return typeof value === "number" && Number.isFinite(value) ? value : null;
}

/** Whether the method reports a line's values.
 *
 * @param {Reading} reading
 * @param {Row} row
 * @param {SessionPublic} session
 * @param {History} history
 */
export function isMeasured({ kind, series }, row, session, history) {
  if (kind === "particles") return measured(session, "particles", row) !== undefined || measured(session, "ess", row) !== undefined;
  if (kind === "samplers") return samplesOf(session, row) !== null;
  return series === "" || history.measures(series);
}

/** The figures of a line.
 *
 * @param {Reading} reading
 * @param {Row|undefined} row
 * @param {SessionPublic} session
 */
export function readingWords(reading, row, session) {
  return row === undefined ? number(null) : WORDS[reading.kind](row, session, reading);
}

/** @type {Record<Reading["kind"], (row: Row, session: SessionPublic, reading: Reading) => string>} */
const WORDS = {
  estimate: ({ estimate }, { unit }) => several(estimate, unit),
  sigma: ({ sigma }, { unit }) => several(sigma, unit),
  error: (row, { unit }) => several([curve.error(row)], unit),
  evidence: (row) => number(row.log_evidence, 2),
  time: (row) => `${number(row.step_ms, 2)} ms`,
  particles(row, session) {
    const [count, ess] = [numberOf(session, "particles", row), numberOf(session, "ess", row)];
    return [count, ess === null ? null : `ESS ${number(ess, 0)}`].filter((part) => part !== null).join(", ");
  },
  // The one sampler of all particles, or the number of particles from each.
  samplers(row, session) {
    const samples = samplesOf(session, row) ?? [];
    const used = samples.filter((count) => count > 0);
    return used.length === 1 ? `${samplers(session)[samples.indexOf(used[0])].name} ${used[0]}` : `mixed ${samples.join(" | ")}`;
  },
  value(row, _, { series, sd, unit }) {
    const value = quantity(valueOf(row, series), unit);
    return withUnit(value === number(null) || !sd ? value : `${value} ± ${quantity(valueOf(row, sd), unit)}`, unit);
  },
  interval(row, _, { series, unit }) {
    const [low, high] = [0, 1].map((end) => quantity(valueOf(row, series, end), unit));
    return withUnit(low === number(null) ? low : `${low} to ${high}`, unit);
  },
  // The first component of the most probable hypothesis, and its probability.
  hypotheses(row, _, { series, unit }) {
    const { values = [], weights: known = [] } = hypothesesOf(row, series) ?? {};
    if (known.length === 0) return number(null);
    const weights = known.map((weight) => weight ?? 0);
    const best = weights.indexOf(Math.max(...weights));
    return `${several([values[best][0]], unit)}, ${number(100 * weights[best], 0)} %, one of ${weights.length}`;
  },
  count(row, session, { series }) {
    const flags = vectorOf(row, series);
    return `${flags.filter((flag) => flag === 1).length} of ${declared(session, series)?.components.length || flags.length}`;
  },
};

/**
 * @param {(number|null)[]} values
 * @param {string} unit
 */
function several(values, unit) {
  return withUnit(values.map((value) => quantity(value, unit)).join(", "), unit);
}

/**
 * @param {string} text
 * @param {string} unit
 */
function withUnit(text, unit) {
  return unit && text !== number(null) ? `${text} ${unit}` : text;
}

/** The verdict on the run in one line, with its source.
 *
 * @param {History} history
 * @param {SessionPublic} session
 * @returns {[words: string, kind: "unknown"|"lost"|"good"|"hidden"]}
 */
export function state(history, session) {
  const row = history.at(session.position);
  if (!row) return ["not computed yet", "unknown"];
  const { searching, lost, hidden } = row;
  if (isGone(row)) {
    const doing = searching ? `, looking for the ${session.target}` : "";
    const byTruth = searching ? "truth and tracker" : "truth";
    return [`lost since ${row.lost_since}${doing} (by ${lost ? byTruth : "the tracker"})`, "lost"];
  }
  if (searching) return [`held (by truth), looking for the ${session.target} (by the tracker)`, "unknown"];
  const source = lost === null ? "by the tracker" : "by truth";
  if (wasSearching(history, session)) return [`${session.target} found again (${source})`, "good"];
  if (hidden === true) return ["hidden (by truth)", "hidden"];
  if (lost === false) return ["held (by truth)", "good"];
  if (row.error !== null) return ["", "unknown"];
  return searching === false ? ["followed (by the tracker)", "good"] : ["truth not known", "unknown"];
}

/** Whether the tracker searched for its target within the last second of the run, so that the message can be read.
 *
 * @param {History} history
 * @param {SessionPublic} session
 */
function wasSearching(history, { position, frame_rate_hz: frameRate }) {
  const frames = Array.from({ length: Math.min(position, Math.ceil(frameRate)) }, (_, back) => position - 1 - back);
  return frames.some((frame) => history.at(frame)?.searching);
}
