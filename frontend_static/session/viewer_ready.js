/**
 * Whether the scene shows a picture of the run. It says so itself: its page is of our own origin, so it can be asked.
 */

import { after } from "../shared/timing.js";

const LOOK_EVERY_MS = 40;
const PATIENCE_MS = 3000;

/**
 * Resolves when the scene in a frame has been drawn, with its camera in place and nothing fading.
 *
 * @param {HTMLIFrameElement} frame
 * @param {() => boolean} isWanted Looking goes on as long as this holds.
 * @param {AbortSignal} signal Ends the looking, without an answer.
 * @returns {Promise<boolean>} False when it is not wanted any more.
 */
export async function viewerReady(frame, isWanted, signal) {
  /** @type {number|null} */
  let since = null;
  while (isWanted()) {
    const found = frame.contentWindow?.pftrackScene?.drawn() ?? null;
    if (found !== null) since ??= performance.now();
    // The camera is put in place by a message of its own; it is not when somebody has already turned it.
    if (found === "in place" || (since !== null && performance.now() - since > PATIENCE_MS)) {
      return isWanted();
    }
    await after(LOOK_EVERY_MS, signal);
  }
  return false;
}
