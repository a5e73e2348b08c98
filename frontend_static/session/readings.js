/**
 * One frame in words: the lines that the experiment declares, and how the run goes. The box of numbers and the text for screen
 * readers share them.
 */

import { number, quantity } from "../shared/format.js";
import { curve, isGone } from "./store.js";

/** @import { Reading, Series, SessionPublic } from "../shared/messages.js" */
/** @import { History, Row } from "./store.js" */

// Series: what tracker and experiment measure of every frame. General code finds them by role or by the name that a plot
// declares; a row has only those that its tracker reports.

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
function vectorOf(row, name) {
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
 * Whether a value says anything: it is a known number, or has one.
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
 * @returns {number|null} Null for all that is not a finite number.
 */
export function finite(value) {
  return typeof value === "number" && Number.isFinite(value) ? value : null;
}

/**
 * Whether the method has something to say in a line.
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

/**
 * The figures of a line.
 *
 * @param {Reading} reading
 * @param {Row|undefined} row
 * @param {SessionPublic} session
 */
export function readingWords(reading, row, session) {
  if (!row) return number(null);
  const { kind, unit, series } = reading;
  const own = session.unit;
  const several = (/** @type {(number|null)[]} */ values) => values.map((value) => quantity(value, own)).join(", ");
  switch (kind) {
    case "estimate":
      return withUnit(several(row.estimate), own);
    case "sigma":
      return withUnit(several(row.sigma), own);
    case "error":
      return withUnit(quantity(curve.error(row), own), own);
    case "particles":
      return particles(row, session);
    case "samplers":
      return proposal(row, session);
    case "evidence":
      return number(row.log_evidence, 2);
    case "time":
      return `${number(row.step_ms, 2)} ms`;
    case "value":
      return withUnit(withSpread(row, reading), unit);
    case "interval":
      return withUnit(between(row, reading), unit);
    case "hypotheses":
      return mostProbable(row, reading);
    case "count": {
      const flags = vectorOf(row, series);
      return `${flags.filter((flag) => flag === 1).length} of ${declared(session, series)?.components.length || flags.length}`;
    }
    default:
      return "";
  }
}

/**
 * @param {string} text
 * @param {string} unit
 */
function withUnit(text, unit) {
  return unit && text !== number(null) ? `${text} ${unit}` : text;
}

/**
 * @param {Row} row
 * @param {SessionPublic} session
 */
function particles(row, session) {
  const [count, ess] = [numberOf(session, "particles", row), numberOf(session, "ess", row)];
  return [count, ess !== null && `ESS ${number(ess, 0)}`].filter((part) => part !== null && part !== false).join(", ");
}

/**
 * The one sampler that all particles came from, or how many came from which.
 *
 * @param {Row} row
 * @param {SessionPublic} session
 */
function proposal(row, session) {
  const samples = samplesOf(session, row) ?? [];
  const used = samples.filter((count) => count > 0);
  return used.length === 1 ? `${samplers(session)[samples.indexOf(used[0])].name} ${used[0]}` : `mixed ${samples.join(" | ")}`;
}

/**
 * A number with its standard deviation, if it has one.
 *
 * @param {Row} row
 * @param {Reading} reading
 */
function withSpread(row, { series, sd, unit }) {
  const value = quantity(valueOf(row, series), unit);
  return value === number(null) || !sd ? value : `${value} ± ${quantity(valueOf(row, sd), unit)}`;
}

/**
 * The ends of an interval.
 *
 * @param {Row} row
 * @param {Reading} reading
 */
function between(row, { series, unit }) {
  const [low, high] = [0, 1].map((end) => quantity(valueOf(row, series, end), unit));
  return low === number(null) ? low : `${low} to ${high}`;
}

/**
 * The first component of the most probable hypothesis, and how probable it is.
 *
 * @param {Row} row
 * @param {Reading} reading
 */
function mostProbable(row, { series, unit }) {
  const { values = [], weights: known = [] } = hypothesesOf(row, series) ?? {};
  if (known.length === 0) return number(null);
  const weights = known.map((weight) => weight ?? 0);
  const best = weights.indexOf(Math.max(...weights));
  return `${withUnit(quantity(values[best][0], unit), unit)}, ${number(100 * weights[best], 0)} %, one of ${weights.length}`;
}

/**
 * One line that says how it goes, and who says so.
 *
 * @param {History} history
 * @param {SessionPublic} session
 * @returns {[words: string, kind: "unknown"|"lost"|"good"|"hidden"]}
 */
export function state(history, session) {
  const row = history.at(session.position);
  if (!row) return ["not computed yet", "unknown"];
  const { searching, lost, hidden } = row;
  if (isGone(row)) return [lossWords(row, session), "lost"];
  if (searching) return [`held (by truth), looking for the ${session.target} (by the tracker)`, "unknown"];
  const source = lost === null ? "by the tracker" : "by truth";
  if (wasSearching(history, session)) return [`${session.target} found again (${source})`, "good"];
  if (hidden === true) return ["hidden (by truth)", "hidden"];
  if (lost === false) return ["held (by truth)", "good"];
  if (row.error !== null) return ["", "unknown"];
  return searching === false ? ["followed (by the tracker)", "good"] : ["truth not known", "unknown"];
}

/**
 * Since when the target is lost, and who says so.
 *
 * @param {Row} row
 * @param {SessionPublic} session
 */
function lossWords(row, session) {
  const doing = row.searching ? `, looking for the ${session.target}` : "";
  const byTruth = row.searching ? "truth and tracker" : "truth";
  return `lost since ${row.lost_since}${doing} (by ${row.lost ? byTruth : "the tracker"})`;
}

/**
 * Whether the tracker looked for its target a moment ago: for a second of the run, so that it can be read.
 *
 * @param {History} history
 * @param {SessionPublic} session
 */
function wasSearching(history, { position, frame_rate_hz: frameRate }) {
  for (let frame = position - 1; frame >= Math.max(0, position - frameRate); frame -= 1) {
    if (history.at(frame)?.searching) return true;
  }
  return false;
}
