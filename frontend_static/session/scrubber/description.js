/** What the scrubber says of a frame, and what its strips show. */

import { percent, quantity } from "../../shared/format.js";
import { curve, isGone } from "../history.js";
import { eventsOf, numberOf, ofRole, samplers, samplesOf } from "../series.js";

/** @import { SessionPublic } from "../../shared/messages.js" */
/** @import { Curve, History } from "../history.js" */
/** @import { Mixture } from "./paint.js" */
/** @import { RowName } from "./rows.js" */

/** The rows that are about series, and of which role. */
const STRIPS = /** @type {const} */ ([
  { row: "ess", role: "ess" },
  { row: "proposal", role: "share" },
  { row: "events", role: "event" },
  { row: "loss", role: "loss_probability" },
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
  else if (isGone(row)) told.push("lost");
  else if (row.hidden) told.push("hidden");
  const probability = numberOf(session, "loss_probability", row);
  if (probability !== null) told.push(`lost with ${percent(probability)}`);
  told.push(...eventsOf(session, row).map(({ title }) => title));
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
 * The rows that no frame has anything for: a method without particles has no ESS, a recording without truth no error.
 * Until a frame is computed nothing is known of the curves, and they keep their room.
 *
 * @param {SessionPublic} session
 * @param {History} history Of the active branch, which alone has strips and bands.
 * @param {{error: boolean, sigma: boolean}} isMeasured Whether any branch has a value of the curves, which share their rows.
 * @returns {RowName[]}
 */
export function missingOf(session, history, isMeasured) {
  // In the first frame no tracker can have lost its target yet: what is told from the next one on has its room.
  const isToCome = (/** @type {string} */ role) => role === "loss_probability" && history.length <= 1;
  /** @type {RowName[]} */
  const missing = STRIPS.filter(({ role }) => !ofRole(session, role).some(({ name }) => isToCome(role) || history.measures(name))).map(({ row }) => row);
  if (history.length === 0) return missing;
  for (const name of /** @type {const} */ (["error", "sigma"])) {
    if (!isMeasured[name]) missing.push(name);
  }
  return goneOf(history) === "" ? [...missing, "bands"] : missing;
}

/**
 * What is known of a target that is not seen: whether it is hidden, whether it is lost, or both; in words.
 *
 * @param {History} history
 */
export function goneOf(history) {
  const [hidden, lost] = [history.some((row) => isFlag(row.hidden)), history.some((row) => Boolean(row.lost_by))];
  return [hidden && "hidden", lost && "lost"].filter((word) => word !== false).join(", ");
}

/** @param {boolean|null|undefined} value */
function isFlag(value) {
  return value === true || value === false;
}

/**
 * How probable it is that the target is lost.
 *
 * @param {SessionPublic} session
 * @returns {Curve}
 */
export function lossOf(session) {
  return (row) => numberOf(session, "loss_probability", row);
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
