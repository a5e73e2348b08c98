/** Jobs: work on the server that takes a while, which is asked for how far it is until it has ended. */

import { pathOf, request, statusOf } from "./api.js";
import { after } from "./timing.js";

/** @import { Job } from "./messages.js" */

/** The first answer is soon asked for, since much takes a moment only. */
const ASK_FIRST_MS = 50;
const ASK_EVERY_MS = 250;
const NOT_FOUND = 404;

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
 * Stop a job, or have the server forget it; nobody waits for that.
 *
 * @param {string} id
 */
export function cancelJob(id) {
  request("DELETE", job(id)).catch(() => {});
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
 * Show on a meter how far a job is.
 *
 * @param {HTMLProgressElement} meter
 * @returns {(now: Job|null) => void}
 */
export function onMeter(meter) {
  return (now) => {
    if (now !== null && now.total > 0) meter.value = now.done / now.total;
  };
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
