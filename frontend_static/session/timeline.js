/** Reading a timeline of parameter changes: what was in force when, and what a change did, in words. */

import { parameterValue } from "../shared/format.js";

/**
 * The value of a parameter in computing a frame.
 *
 * @param {object} session
 * @param {string} name A parameter, or "tracker".
 * @param {number} frame
 */
export function valueAt(session, name, frame) {
  let value = valueAtStart(session, name);
  for (const change of session.timeline ?? []) {
    if (change.frame <= frame && name in change.values) value = change.values[name];
  }
  return value;
}

/**
 * The value that the run began with. The session tells the values now in force; a parameter that was never changed has
 * had this value all along, for the others there is what the session began with, or failing that the default.
 */
function valueAtStart(session, name) {
  const changed = (session.timeline ?? []).some((change) => name in change.values);
  const now = name === "tracker" ? session.tracker : session.parameters?.[name];
  if (!changed) return now;
  const begun = name === "tracker" ? session.first_tracker : session.first_parameters?.[name];
  return begun ?? session.declarations?.find((declaration) => declaration.name === name)?.default;
}

/**
 * Changes as diamonds: one for each frame with changes after the start.
 *
 * @returns {{frame: number, lines: string[]}[]}
 */
export function marks(session) {
  return (session.timeline ?? [])
    .filter((change) => change.frame > 0)
    .map((change) => ({
      frame: change.frame,
      lines: trackerFirst(change.values).map(([name, value]) => {
        const [title, before, after] = inWords(session, name, valueAt(session, name, change.frame - 1), value);
        return before === after || before === null ? `${title} ${after}` : `${title} ${before} → ${after}`;
      }),
    }));
}

function trackerFirst(values) {
  return Object.entries(values).sort(([a], [b]) => (b === "tracker") - (a === "tracker"));
}

function inWords(session, name, before, after) {
  if (name === "tracker") return ["Tracker", before === undefined ? null : trackerTitle(session, before), trackerTitle(session, after)];
  const declaration = session.declarations?.find((candidate) => candidate.name === name);
  const plain = before === undefined ? null : parameterValue(before, null);
  return [declaration?.title ?? name, plain, parameterValue(after, declaration)];
}

/** A tracker's name as people know it. */
export function trackerTitle(session, id) {
  return session.trackers?.find((tracker) => tracker.id === id)?.title ?? id ?? "–";
}

/**
 * The thresholds that the tracker compares sigma with, as they changed.
 *
 * @returns {{name: string, steps: {frame: number, value: number}[]}[]} From each step's frame on its value holds; null
 *     while a tracker that does not read it was in charge.
 */
export function thresholds(session) {
  const gammas = (session.declarations ?? []).filter(({ name, kind }) => name.startsWith("gamma") && kind === "number");
  const frames = [0, ...(session.timeline ?? []).map((change) => change.frame)];
  return gammas
    .map((declaration) => ({
      name: declaration.name,
      steps: [...new Set(frames)].sort((a, b) => a - b).map((frame) => {
        const tracker = valueAt(session, "tracker", frame);
        const read = declaration.trackers.length === 0 || declaration.trackers.includes(tracker);
        return { frame, value: read ? valueAt(session, declaration.name, frame) : null };
      }),
    }))
    .filter(({ steps }) => steps.some(({ value }) => value !== null));
}
