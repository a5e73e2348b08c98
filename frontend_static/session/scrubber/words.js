/** What the scrubber says of a frame, and what its strips show. */

import { quantity } from "../../shared/format.js";
import { curve } from "../history.js";
import { numberOf, ofRole, samplers, samplesOf } from "../series.js";

/** @import { SessionPublic } from "../../shared/messages.js" */
/** @import { Curve, History } from "../history.js" */
/** @import { Mixture } from "./paint.js" */

/** The rows that are about series, and of which role. */
const STRIPS = /** @type {const} */ ([
  { row: "ess", role: "ess" },
  { row: "proposal", role: "share" },
]);

/**
 * A frame in words.
 *
 * @param {import("../store.js").Store} store
 * @param {number} frame
 * @returns {string[]}
 */
export function describe({ known: session, history }, frame) {
  const row = history.at(frame);
  const unit = session.unit;
  if (!row) return [`frame ${frame}`, "not computed yet"];
  const told = [`frame ${frame}`];
  if (curve.error(row) !== null) told.push(`error ${quantity(curve.error(row), unit)} ${unit}`.trim());
  if (curve.sigma(row) !== null) told.push(`sigma ${quantity(curve.sigma(row), unit)} ${unit}`.trim());
  if (row.searching) told.push(`no ${session.target}`);
  else if (row.lost) told.push("lost");
  else if (row.hidden) told.push("hidden");
  return told;
}

/**
 * Where the particles came from.
 *
 * @param {SessionPublic} session
 * @returns {Mixture}
 */
export function mixtureOf(session) {
  const [series] = ofRole(session, "share");
  const colours = samplers(session).map(({ colour }) => colour);
  return {
    label: series?.title ?? "",
    shares: (row) => {
      const samples = samplesOf(session, row) ?? [];
      const total = samples.reduce((sum, count) => sum + count, 0);
      return total > 0 ? samples.map((count, place) => ({ colour: colours[place], share: count / total })) : [];
    },
  };
}

/**
 * The strips that no frame has anything for.
 *
 * @param {SessionPublic} session
 * @param {History} history
 */
export function missingOf(session, history) {
  return STRIPS.filter(({ role }) => !ofRole(session, role).some(({ name }) => history.measures(name))).map(({ row }) => row);
}

/**
 * Which share of the particles carries the weight.
 *
 * @param {SessionPublic} session
 * @returns {Curve}
 */
export function weightOf(session) {
  return (row) => {
    const [ess, particles] = [numberOf(session, "ess", row), numberOf(session, "particles", row)];
    return ess !== null && particles !== null && particles > 0 ? ess / particles : null;
  };
}
