/** Jobs: work on the server that takes a while, which is asked for how far it is until it has ended. */

import { statusOf } from "./api.js";
import { after } from "./timing.js";

const ASK_EVERY_MS = 400;

/** @typedef {{id: string, state: string, done: number, total: number}} Job */

/**
 * Ask for a job until it has ended; null if it is no longer wanted.
 *
 * @template {Job} T
 * @param {T} begun
 * @param {string} working Its state while it goes on.
 * @param {(id: string) => Promise<T>} ask
 * @param {(now: T|null) => void} tell Hears how far it is; null where the server does not answer and is asked again.
 * @param {() => boolean} isWanted
 * @returns {Promise<T|null>}
 */
export async function followJob(begun, working, ask, tell, isWanted) {
  let job = begun;
  while (job.state === working) {
    await after(ASK_EVERY_MS);
    if (!isWanted()) return null;
    const now = await heard(ask(begun.id));
    if (!isWanted()) return null;
    tell(now);
    job = now ?? job;
  }
  return isWanted() ? job : null;
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
 * @template T
 * @param {Promise<T>} asked
 * @returns {Promise<T|null>}
 */
async function heard(asked) {
  try {
    return await asked;
  } catch (error) {
    if (statusOf(error) === 0) return null;
    throw error;
  }
}
