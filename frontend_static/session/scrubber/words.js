/** What the scrubber says of a frame, and what its strips show. */

import { quantity } from "../../shared/format.js";
import { curve } from "../history.js";
import { numberOf, ofRole, samplers, samplesOf } from "../series.js";

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

/** Where the particles came from: the label, and of a row [colour, share] for each sampler, null where it has none. */
export function mixtureOf(session) {
  const [series] = ofRole(session, "share");
  const colours = samplers(session).map(({ colour }) => colour);
  const shares = (row) => {
    const samples = samplesOf(session, row);
    const total = samples?.reduce((sum, count) => sum + count, 0) ?? 0;
    return total > 0 ? samples.map((count, place) => [colours[place], count / total]) : null;
  };
  return { label: series?.title ?? "", shares };
}

/** The strips that no frame has anything for. */
export function missingOf({ session, history }) {
  const roles = { ess: "ess", proposal: "share" };
  return Object.keys(roles).filter((row) => !ofRole(session, roles[row]).some(({ name }) => history.measures(name)));
}

/** Which share of the particles carries the weight, of a row; null where there are none. */
export function weightOf(session) {
  return (row) => {
    const [ess, particles] = ["ess", "particles"].map((role) => numberOf(session, role, row));
    return ess !== null && particles !== null && particles > 0 ? ess / particles : null;
  };
}
