/** A server has so many places for sessions: whoever finds all of them taken waits for one. */

import { ApiError, messageOf } from "./api.js";
import { after } from "./timing.js";

const UNAVAILABLE = 503;
const EVERY_MS = 3000;

/**
 * Do something that needs a place, as soon as there is one.
 *
 * @template Answer
 * @param {() => Promise<Answer>} act
 * @param {(sentence: string) => void} tell What to say meanwhile; empty when there is nothing more to wait for.
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
      if (!(error instanceof ApiError) || error.status !== UNAVAILABLE || signal.aborted) throw error;
      tell(messageOf(error).replace(/\.$/, ""));
      await after(EVERY_MS, signal);
    }
  }
}
