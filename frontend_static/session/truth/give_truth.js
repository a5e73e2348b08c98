/** Giving a session a table of what is truly so. */

import { api } from "../../shared/api.js";
import { count } from "../../shared/format.js";
import { attempt, toast } from "../../shared/toast.js";

/**
 * Have a run measured by a table of truth, in place of one that was given before.
 *
 * @param {string} session
 * @param {File[]} files
 * @returns {Promise<boolean>} Whether it was taken.
 */
export async function giveTruth(session, files) {
  const told = await attempt(() => api.giveSessionTruth(session, files));
  if (told === undefined) return false;
  const known = `The truth of ${count(told.frames, "frame")} is known; the run is measured by it`;
  toast([known, ...told.warnings].join(". "));
  return true;
}
