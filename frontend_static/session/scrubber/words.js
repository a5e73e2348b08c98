/** What the scrubber says of a frame, and which mixture it shows. */

import { quantity, unitOf } from "../../shared/format.js";
import { curve } from "../history.js";

/**
 * A frame in words.
 *
 * @param {import("../store.js").Store} store
 * @param {number} frame
 * @returns {string[]}
 */
export function describe({ session, history }, frame) {
  const row = history.at(frame);
  const unit = unitOf(session);
  if (!row) return [`frame ${frame}`, "not computed yet"];
  const told = [`frame ${frame}`];
  if (curve.error(row) !== null) told.push(`error ${quantity(curve.error(row), unit)} ${unit}`.trim());
  if (curve.sigma(row) !== null) told.push(`sigma ${quantity(curve.sigma(row), unit)} ${unit}`.trim());
  if (row.searching) told.push(`no ${session.target}`);
  else if (row.lost) told.push("lost");
  else if (row.hidden) told.push("hidden");
  return told;
}

/** Which share of the particles is painted in the colour of the observation: as the experiment's plots have it. */
export function mixtureOf(session) {
  const features = session.plots.find(({ kind }) => kind === "features");
  if (features === undefined) return { label: "proposal", share: (row) => ratio(curve.observation(row), curve.prediction(row)) };
  return { label: features.id, share: (row) => mean(row?.series?.[features.series[0]]) };
}

function ratio(one, other) {
  return one + other > 0 ? one / (one + other) : null;
}

function mean(values) {
  const known = values?.filter(Number.isFinite) ?? [];
  return known.length > 0 ? known.reduce((sum, value) => sum + value, 0) / known.length : null;
}
