/** Waiting: for the compiler, once after an installation or an update, and for a place for a session. */

import { h } from "../vendor/preact.js";
import { messageOf, Meter, request, statusOf } from "./api.js";
import { elementOf } from "./dom.js";
import { after } from "./timing.js";

/** @import { CompilationPublic } from "./messages.js" */

/** @typedef {(sentence: string, meter?: Element) => void} Tell What to show; an empty sentence when the waiting is over. */

const EVERY_MS = 1000;
const PLACE_EVERY_MS = 3000;
const UNAVAILABLE = 503;

/** Report the progress of compiling until it is done.
 *
 * @param {(compilation: CompilationPublic) => void} tell
 * @param {(compilation: CompilationPublic) => boolean} [isEnough] Whether the progress is enough.
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

/** Run an action that needs an experiment once that is compiled.
 *
 * @template Answer
 * @param {string} experiment
 * @param {() => Promise<Answer>} act
 * @param {Tell} tell
 * @param {AbortSignal} signal Ends the waiting; nothing is done then.
 * @param {"ready"|"usable"} needed The whole experiment, or its default settings.
 * @returns {Promise<Answer>}
 */
export async function whenCompiled(experiment, act, tell, signal, needed = "ready") {
  try {
    return await act();
  } catch (error) {
    if (statusOf(error) !== UNAVAILABLE || signal.aborted) throw error;
    // It may have become ready; a refusal then has another reason.
    const say = (/** @type {CompilationPublic} */ now) => tell(inSentenceCase(now.sentence), elementOf(h(CompilationMeter, now)));
    await followCompiling(say, (now) => now[needed].includes(experiment), signal);
    if (signal.aborted) throw error;
    tell("");
    return act();
  }
}

/** Run an action that needs a place for a session once the server has one.
 *
 * @template Answer
 * @param {() => Promise<Answer>} act
 * @param {(sentence: string) => void} tell Shows the reason for waiting; empty when the waiting is over.
 * @param {AbortSignal} signal Ends the waiting; nothing is done then.
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
