/** Asking the server to compare runs: what differs comes at once, what came of them while it is computed. */

import { request, statusOf } from "../shared/api.js";
import { whenCompiled } from "../shared/compiling.js";
import { after } from "../shared/timing.js";

/** @import { ComparedRun, RunComparisonPublic } from "../shared/messages.js" */

const EVERY_MS = 500;
const NOT_FOUND = 404;

/** @param {string} id */
const path = (id) => `comparisons/${encodeURIComponent(id)}`;

/**
 * Begin to compare runs.
 *
 * @param {ComparedRun[]} runs
 * @param {(sentence: string) => void} tell What to say while an experiment is compiled; empty when there is nothing to wait for.
 * @param {AbortSignal} signal
 * @returns {Promise<RunComparisonPublic>}
 */
export function begin(runs, tell, signal) {
  const experiment = runs.find(({ recipe }) => recipe)?.recipe?.experiment ?? "";
  return whenCompiled(experiment, () => request("POST", "comparisons", { runs }, signal), tell, signal);
}

/**
 * Tell how far a comparison is, again and again until it has ended. One that the server does not know any more, as after it
 * was restarted, is begun anew.
 *
 * @param {RunComparisonPublic} begun
 * @param {ComparedRun[]} runs
 * @param {(comparison: RunComparisonPublic) => void} tell
 * @param {AbortSignal} signal Ends it, on the server as well.
 */
export async function follow(begun, runs, tell, signal) {
  let comparison = begun;
  const drop = () => {
    if (comparison.state === "computing") request("DELETE", path(comparison.id)).catch(() => {});
  };
  signal.addEventListener("abort", drop);
  while (!signal.aborted) {
    tell(comparison);
    if (comparison.state !== "computing") return;
    await after(EVERY_MS, signal);
    try {
      comparison = await request("GET", path(comparison.id), undefined, signal);
    } catch (error) {
      // While the server is away it is asked again.
      if (statusOf(error) === NOT_FOUND) comparison = await begin(runs, () => {}, signal);
      else if (statusOf(error) !== 0) throw error;
    }
  }
}
