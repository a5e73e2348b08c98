/** Asking the server to compare runs: what differs comes at once, what came of them while it is computed. */

import { request } from "../shared/api.js";
import { whenCompiled } from "../shared/compiling.js";
import { cancelJob, followJob } from "../shared/jobs.js";

/** @import { ComparedRun, ComparisonJob } from "../shared/messages.js" */

/**
 * Begin to compare runs.
 *
 * @param {ComparedRun[]} runs
 * @param {(sentence: string) => void} tell What to say while an experiment is compiled; empty when there is nothing to wait for.
 * @param {AbortSignal} signal
 * @returns {Promise<ComparisonJob>}
 */
export function begin(runs, tell, signal) {
  const experiment = runs.find(({ recipe }) => recipe)?.recipe?.experiment ?? "";
  return whenCompiled(experiment, () => request("POST", "comparisons", { runs }, signal), tell, signal);
}

/**
 * Tell how far a comparison is, again and again until it has ended. One that the server does not know any more, as after it
 * was restarted, is begun anew.
 *
 * @param {ComparisonJob} begun
 * @param {ComparedRun[]} runs
 * @param {(comparison: ComparisonJob) => void} tell
 * @param {AbortSignal} signal Ends it, on the server as well.
 */
export async function follow(begun, runs, tell, signal) {
  let comparison = begun;
  const hear = (/** @type {ComparisonJob|null} */ now) => {
    if (now !== null) tell((comparison = now));
  };
  signal.addEventListener("abort", () => comparison.state === "working" && cancelJob(comparison.id));
  tell(begun);
  await followJob(begun, hear, signal, () => begin(runs, () => {}, signal));
}
