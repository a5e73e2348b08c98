/** The "this frame" box: the numbers behind the picture, as the experiment declares them. */

import { fill, h, setText } from "../shared/dom.js";
import { number, quantity } from "../shared/format.js";
import { coalesce } from "../shared/timing.js";
import { curve } from "./history.js";
import { measures } from "./measures.js";
import { between, withSpread } from "./plots/kinds/band.js";
import { mostProbable } from "./plots/kinds/hypotheses.js";
import { declared, measured, numberOf, samplers, samplesOf, vectorOf } from "./series.js";

/** @import { Reading, SessionPublic } from "../shared/messages.js" */
/** @import { History, Row } from "./history.js" */

/**
 * @param {HTMLElement} root
 * @param {import("./mount.js").Mounted} view
 */
export function readout(root, view) {
  const { store, signal } = view;
  const verdict = h("p", { class: "verdict" });
  const list = h("dl", {});
  fill(root, h("h2", { class: "visually-hidden" }, "This frame"), verdict, list);
  measures(root, view);
  /** @type {Reading[]} */
  let readings = [];
  /** @type {{title: HTMLElement, value: HTMLElement}[]} */
  let lines = [];
  const draw = coalesce(() => {
    const { session, history } = store;
    if (session === null) return;
    if (session.readings.length !== readings.length) {
      readings = session.readings;
      lines = readings.map(({ title }) => ({ title: h("dt", {}, title), value: h("dd", {}) }));
      fill(list, lines.map(({ title, value }) => [title, value]));
    }
    const row = history.at(session.position);
    readings.forEach((reading, place) => {
      const { title, value } = lines[place];
      // A line of which the method has nothing at all is left out; one that is not known in this frame stays in its place.
      title.hidden = value.hidden = row !== undefined && !isMeasured(reading, row, session, history);
      setText(value, words(reading, row, session));
    });
    const [text, kind] = state(history, session);
    setText(verdict, text);
    verdict.dataset.kind = kind;
  }, signal);
  store.on(["session", "position", "history", "branches"], draw);
}

/**
 * @param {Reading} reading
 * @param {Row} row
 * @param {SessionPublic} session
 * @param {History} history
 */
function isMeasured({ kind, series }, row, session, history) {
  if (kind === "particles") return measured(session, "particles", row) !== undefined || measured(session, "ess", row) !== undefined;
  if (kind === "samplers") return samplesOf(session, row) !== null;
  return series === "" || history.measures(series);
}

/**
 * @param {Reading} reading
 * @param {Row|undefined} row
 * @param {SessionPublic} session
 */
function words(reading, row, session) {
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
      return withUnit(withSpread(row, { ...reading, series: [series] }), unit);
    case "interval":
      return withUnit(between(row, series, unit), unit);
    case "hypotheses":
      return mostProbable(row, { series: [series], unit });
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
 * One line that says how it goes.
 *
 * @param {History} history
 * @param {SessionPublic} session
 * @returns {[words: string, kind: "unknown"|"lost"|"good"|"hidden"]}
 */
function state(history, { position, target, frame_rate_hz: frameRate }) {
  const row = history.at(position);
  if (!row) return ["not computed yet", "unknown"];
  const since = row.lost_since;
  if (row.searching) return [`lost since ${since}, looking for the ${target}`, "lost"];
  // For a second of the run, so that it can be read.
  for (let frame = position - 1; frame >= Math.max(0, position - frameRate); frame -= 1) {
    if (history.at(frame)?.searching) return [`${target} found again`, "good"];
  }
  if (row.lost) return [`lost since ${since}`, "lost"];
  if (row.hidden === true) return ["hidden", "hidden"];
  if (row.lost === false) return ["on target", "good"];
  return [row.error === null ? "truth not known" : "", "unknown"];
}
