/** What is compiled once after an installation or an update: how far it is, for as long as it lasts. */

import { api, statusOf } from "./api.js";
import { h } from "./dom.js";
import { after } from "./timing.js";

/** @import { CompilationPublic } from "./messages.js" */
/** @typedef {(sentence: string, meter?: HTMLElement) => void} Tell What to show; an empty sentence when the waiting is over. */

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
 * @param {Tell} tell
 * @param {AbortSignal} signal Ends the waiting; then nothing more is done.
 * @param {"ready"|"usable"} needed All of it, or how it is by default.
 * @returns {Promise<Answer>}
 */
export async function whenCompiled(experiment, act, tell, signal, needed = "ready") {
  try {
    return await act();
  } catch (error) {
    if (statusOf(error) !== UNAVAILABLE || signal.aborted) throw error;
    // It may have been ready since; what the server refuses then, it refuses for another reason.
    await followUntil(experiment, needed, tell, signal);
    if (signal.aborted) throw error;
    return act();
  }
}

/**
 * @param {string} experiment
 * @param {"ready"|"usable"} needed
 * @param {Tell} tell
 * @param {AbortSignal} signal
 */
async function followUntil(experiment, needed, tell, signal) {
  for (;;) {
    const compilation = await api.compilation();
    if (signal.aborted) return;
    if (compilation.finished || compilation[needed].includes(experiment)) break;
    tell(inSentenceCase(compilation.sentence), compilationMeter(compilation));
    await after(EVERY_MS, signal);
  }
  tell("");
}

/**
 * @param {CompilationPublic} compilation
 * @returns {HTMLProgressElement} How far it is, as a bar; it only moves while the number of functions is not known.
 */
export function compilationMeter({ done, total }) {
  return h("progress", { ...(total > 0 && { max: total, value: Math.min(done, total) }), "aria-label": "Functions compiled" });
}

/** @param {string} sentence */
export function inSentenceCase(sentence) {
  return sentence.slice(0, 1).toUpperCase() + sentence.slice(1);
}
