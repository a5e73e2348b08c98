/**
 * Doing less: several ways of not doing the same thing too often. Each wait ends with its signal, so that a part of a page
 * leaves no timer behind when it goes.
 */

/**
 * Run `work` at most once a frame of the display, however often it is asked for.
 *
 * @param {() => void} work
 * @param {AbortSignal} [signal] Nothing is run after it.
 * @returns {() => void}
 */
export function coalesce(work, signal) {
  let asked = 0;
  signal?.addEventListener("abort", () => cancelAnimationFrame(asked));
  return () => {
    if (asked !== 0 || signal?.aborted) return;
    asked = requestAnimationFrame(() => {
      asked = 0;
      work();
    });
  };
}

/**
 * Run `work` at most every `milliseconds`, the last request always being served.
 *
 * @param {() => void} work
 * @param {number} milliseconds
 * @param {AbortSignal} [signal] Nothing is run after it.
 * @returns {() => void}
 */
export function throttle(work, milliseconds, signal) {
  let last = 0;
  let timer = 0;
  const now = () => {
    timer = 0;
    last = performance.now();
    work();
  };
  signal?.addEventListener("abort", () => clearTimeout(timer));
  return () => {
    if (timer !== 0 || signal?.aborted) return;
    timer = setTimeout(now, Math.max(0, last + milliseconds - performance.now()));
  };
}

/**
 * Run `work` after a while, unless the signal ends the waiting.
 *
 * @param {() => void} work
 * @param {number} milliseconds
 * @param {AbortSignal} [signal]
 * @returns {() => void} Ends the waiting, too.
 */
export function later(work, milliseconds, signal) {
  if (signal?.aborted) return () => {};
  const stop = () => {
    clearTimeout(timer);
    signal?.removeEventListener("abort", stop);
  };
  const timer = setTimeout(() => {
    stop();
    work();
  }, milliseconds);
  signal?.addEventListener("abort", stop);
  return stop;
}

/**
 * Resolves after a while; never after the signal.
 *
 * @param {number} milliseconds
 * @param {AbortSignal} [signal]
 * @returns {Promise<void>}
 */
export function after(milliseconds, signal) {
  return new Promise((resolve) => {
    later(resolve, milliseconds, signal);
  });
}

/**
 * Resolves when the browser has nothing better to do, or after a while.
 *
 * @returns {Promise<void>}
 */
export function idle() {
  return new Promise((resolve) => {
    if ("requestIdleCallback" in globalThis) requestIdleCallback(() => resolve(), { timeout: 1000 });
    else setTimeout(resolve, 0);
  });
}
