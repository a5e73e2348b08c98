/** Jobs: work on the server that takes a while, which is asked for how far it is until it has ended. */

import { ROOT, pathOf, request, statusOf } from "./api.js";
import { duration } from "./format.js";
import { after } from "./timing.js";
import { html } from "../vendor/preact.js";

/** @import { Job } from "./messages.js" */

/** The first answer is soon asked for, since much takes a moment only. */
const ASK_FIRST_MS = 50;
const ASK_EVERY_MS = 250;
const NOT_FOUND = 404;
/** A rate is a rate only after a while. */
const RATE_AFTER_S = 2;

const job = pathOf("jobs");

/**
 * @template {Job} T
 * @param {string} id
 * @returns {Promise<T>}
 */
export function jobOf(id) {
  return request("GET", job(id));
}

/**
 * Stop a job, or have the server forget it. The request outlives the page, and nobody waits for its answer.
 *
 * @param {string} id
 */
export function cancelJob(id) {
  fetch(ROOT + job(id), { method: "DELETE", keepalive: true }).catch(() => {});
}

/**
 * Follow a job until it ends; null if the caller stopped it.
 *
 * @template {Job} T
 * @param {T} begun
 * @param {(now: T|null) => void} tell Hears how far it is, also in the end; null where the server does not answer and is asked again.
 * @param {AbortSignal} signal Ends the asking; the job itself goes on until it is cancelled.
 * @param {() => Promise<T>} [again] Begins it anew where the server does not know it any more, as after a restart.
 * @returns {Promise<T|null>}
 */
export async function followJob(begun, tell, signal, again) {
  let known = begun;
  for (let wait = ASK_FIRST_MS; known.state === "working"; wait = Math.min(2 * wait, ASK_EVERY_MS)) {
    await after(wait);
    if (signal.aborted) return null;
    /** @type {T|null} */
    const now = await ask(known.id, again);
    if (signal.aborted) return null;
    tell(now);
    known = now ?? known;
  }
  return signal.aborted ? null : known;
}

/**
 * "Computing frame 1,200 of 4,000, about 40 s left".
 *
 * @param {number} frame
 * @param {number} goal
 * @param {number} seconds Since it began.
 * @param {number} frames Computed since then.
 */
export function progressWords(frame, goal, seconds, frames) {
  const place = `Computing frame ${frame.toLocaleString("en")} of ${goal.toLocaleString("en")}`;
  if (seconds < RATE_AFTER_S || frames <= 0) return place;
  return `${place}, about ${duration((seconds * (goal - frame)) / frames)} left`;
}

/** @param {{share: number|null, label: string}} props How far something is; it only moves while the share is not known. */
export function Meter({ share, label }) {
  return html`<progress key=${share === null ? "moving" : "known"} max="1" value=${share ?? undefined} aria-label=${label}></progress>`;
}

/**
 * An answer; null where there was none, since the server can be asked again.
 *
 * @template {Job} T
 * @param {string} id
 * @param {() => Promise<T>} [again]
 * @returns {Promise<T|null>}
 */
async function ask(id, again) {
  try {
    /** @type {T} */
    const now = await jobOf(id);
    return now;
  } catch (error) {
    if (statusOf(error) === NOT_FOUND && again) return again();
    if (statusOf(error) === 0) return null;
    throw error;
  }
}
