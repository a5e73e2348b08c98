/**
 * One frame in words: the lines that the experiment declares, and how the run goes. The box of numbers and the text for screen
 * readers share them.
 */

import { number, quantity } from "../shared/format.js";
import { curve, isGone } from "./history.js";
import { declared, hypothesesOf, measured, numberOf, samplers, samplesOf, valueOf, vectorOf } from "./series.js";

/** @import { Reading, SessionPublic } from "../shared/messages.js" */
/** @import { History, Row } from "./history.js" */

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
export function words(reading, row, session) {
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
