/** What a page may have to wait for: the compiler, once after an installation or an update, and a place for a session. */

import { h } from "../vendor/preact.js";
import { messageOf, Meter, request, statusOf } from "./api.js";
import { elementOf } from "./dom.js";
import { after } from "./timing.js";

/** @import { CompilationPublic } from "./messages.js" */

/** @typedef {(sentence: string, meter?: Element) => void} Tell What to show; an empty sentence when the waiting is over. */

const EVERY_MS = 1000;
const PLACE_EVERY_MS = 3000;
const UNAVAILABLE = 503;

/**
 * Tell how far compiling is, again and again until it is done.
 *
 * @param {(compilation: CompilationPublic) => void} tell
 * @param {(compilation: CompilationPublic) => boolean} [isEnough] Whether so much of it will do.
 * @param {AbortSignal} [signal] Ends it.
 */
export async function followCompiling(tell, isEnough = () => false, signal) {
  for (;;) {
    const compilation = await request("GET compilation");
    if (signal?.aborted || compilation.finished || isEnough(compilation)) return;
    tell(compilation);
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
    const say = (/** @type {CompilationPublic} */ now) => tell(inSentenceCase(now.sentence), elementOf(h(CompilationMeter, now)));
    await followCompiling(say, (now) => now[needed].includes(experiment), signal);
    if (signal.aborted) throw error;
    tell("");
    return act();
  }
}

/**
 * Do something that needs a place for a session, as soon as the server has one.
 *
 * @template Answer
 * @param {() => Promise<Answer>} act
 * @param {(sentence: string) => void} tell What to say meanwhile; empty when the waiting is over.
 * @param {AbortSignal} signal Ends the waiting; then nothing more is done.
 * @returns {Promise<Answer>}
 */
export async function whenPlaceFree(act, tell, signal) {
  for (let isFirst = true; ; isFirst = false) {
    try {
      const answer = await act();
      if (!isFirst) tell("");
      return answer;
    } catch (error) {
      if (statusOf(error) !== UNAVAILABLE || signal.aborted) throw error;
      tell(messageOf(error).replace(/\.$/, ""));
      await after(PLACE_EVERY_MS, signal);
    }
  }
}

/** @param {CompilationPublic} compilation */
export function CompilationMeter({ done, total }) {
  return h(Meter, { share: total > 0 ? done / total : null, label: "Functions compiled" });
}

/** @param {string} sentence */
export function inSentenceCase(sentence) {
  return sentence.slice(0, 1).toUpperCase() + sentence.slice(1);
}
