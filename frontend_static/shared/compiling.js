/** What is compiled once after an installation or an update: how far it is, for as long as it lasts. */

import { api, statusOf } from "./api.js";
import { after } from "./timing.js";

/** @import { CompilationPublic } from "./messages.js" */

const EVERY_MS = 1000;
const UNAVAILABLE = 503;

/**
 * Tell how far compiling is, again and again until it is done.
 *
 * @param {(compilation: CompilationPublic) => void} tell Is called at least once.
 * @param {AbortSignal} [signal] Ends it.
 */
export async function followCompiling(tell, signal) {
  for (;;) {
    const compilation = await api.compilation();
    if (signal?.aborted) return;
    tell(compilation);
    if (compilation.finished) return;
    await after(EVERY_MS, signal);
  }
}

/**
 * Do something that needs an experiment, as soon as that is compiled.
 *
 * @template Answer
 * @param {string} experiment
 * @param {() => Promise<Answer>} act
 * @param {(sentence: string) => void} tell What to show meanwhile; empty when there is nothing more to wait for.
 * @param {AbortSignal} signal Ends the waiting; then nothing more is done.
 * @returns {Promise<Answer>}
 */
export async function whenCompiled(experiment, act, tell, signal) {
  try {
    return await act();
  } catch (error) {
    if (statusOf(error) !== UNAVAILABLE || signal.aborted) throw error;
    // It may have been ready since; what the server refuses then, it refuses for another reason.
    await followUntil(experiment, tell, signal);
    if (signal.aborted) throw error;
    return act();
  }
}

/**
 * @param {string} experiment
 * @param {(sentence: string) => void} tell
 * @param {AbortSignal} signal
 */
async function followUntil(experiment, tell, signal) {
  for (;;) {
    const { finished, ready, sentence } = await api.compilation();
    if (signal.aborted) return;
    if (finished || ready.includes(experiment)) break;
    tell(inSentenceCase(sentence));
    await after(EVERY_MS, signal);
  }
  tell("");
}

/** @param {string} sentence */
export function inSentenceCase(sentence) {
  return sentence.slice(0, 1).toUpperCase() + sentence.slice(1);
}
