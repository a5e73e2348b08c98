/** What is compiled once after an installation or an update: how far it is, for as long as it lasts. */

import { api, statusOf } from "./api.js";

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
    await pause();
  }
}

/**
 * Do something that needs an experiment, as soon as that is compiled.
 *
 * @template Answer
 * @param {string} experiment
 * @param {() => Promise<Answer>} act
 * @param {(sentence: string) => void} tell What to show meanwhile; empty when there is nothing more to wait for.
 * @param {AbortSignal} signal Ends the waiting.
 * @returns {Promise<Answer>}
 */
export async function whenCompiled(experiment, act, tell, signal) {
  for (;;) {
    try {
      return await act();
    } catch (error) {
      if (statusOf(error) !== UNAVAILABLE || signal.aborted) throw error;
      const compilation = await api.compilation();
      if (compilation.finished || compilation.ready.includes(experiment)) throw error;
      await followUntil(experiment, tell, signal);
    }
  }
}

/**
 * @param {string} experiment
 * @param {(sentence: string) => void} tell
 * @param {AbortSignal} signal
 */
async function followUntil(experiment, tell, signal) {
  while (!signal.aborted) {
    const compilation = await api.compilation();
    if (compilation.finished || compilation.ready.includes(experiment)) break;
    tell(inSentenceCase(compilation.sentence));
    await pause();
  }
  tell("");
}

/** @param {string} sentence */
export function inSentenceCase(sentence) {
  return sentence.slice(0, 1).toUpperCase() + sentence.slice(1);
}

/** @returns {Promise<void>} */
function pause() {
  return new Promise((resolve) => {
    setTimeout(resolve, EVERY_MS);
  });
}
