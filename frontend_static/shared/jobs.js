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
 * @param {(share: number) => void} onStep Hears how much of it is done, 0 to 1.
 * @param {() => boolean} isWanted
 * @returns {Promise<T|null>}
 */
export async function followJob(begun, working, ask, onStep, isWanted) {
  let job = begun;
  while (job.state === working) {
    await after(ASK_EVERY_MS);
    if (!isWanted()) return null;
    job = (await heard(ask(begun.id))) ?? job;
    if (job.total > 0) onStep(job.done / job.total);
  }
  return isWanted() ? job : null;
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
