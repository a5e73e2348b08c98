/** The edge of the signals: what is done, beside components, when a value changes, and waiting for one. */

import { effect, untracked } from "../vendor/preact.js";

/**
 * Run `act` now and whenever a signal changes that `look` reads.
 *
 * @param {() => unknown} look
 * @param {() => void} act May read and change signals: those do not count.
 * @param {AbortSignal} end Nothing is run after it.
 */
export function follow(look, act, end) {
  if (end.aborted) return;
  const stop = effect(() => {
    look();
    untracked(act);
  });
  end.addEventListener("abort", stop);
}

/**
 * Resolves as soon as something holds; never after the end.
 *
 * @param {() => unknown} holds Reads signals.
 * @param {AbortSignal} end
 * @returns {Promise<void>}
 */
export function until(holds, end) {
  return new Promise((resolve) => {
    // Once it holds, nothing is read any more, and nothing followed.
    let isSo = false;
    follow(() => (isSo ||= Boolean(holds())), () => isSo && resolve(), end);
  });
}
