/** Doing less: several ways of not doing the same thing too often. */

/** Run `work` at most once a frame of the display, however often it is asked for. */
export function coalesce(work) {
  let asked = false;
  return () => {
    if (asked) return;
    asked = true;
    requestAnimationFrame(() => {
      asked = false;
      work();
    });
  };
}

/** Run `work` at most every `milliseconds`, the last request always being served. */
export function throttle(work, milliseconds) {
  let last = 0;
  let timer = 0;
  const now = () => {
    timer = 0;
    last = performance.now();
    work();
  };
  return () => {
    if (timer !== 0) return;
    timer = setTimeout(now, Math.max(0, last + milliseconds - performance.now()));
  };
}

/** Send one request at a time; of those asked for meanwhile only the newest is sent. */
export function latest(send) {
  let busy = false;
  let waiting = null;
  return async function ask(...wish) {
    if (busy) {
      waiting = wish;
      return;
    }
    busy = true;
    try {
      await send(...wish);
    } finally {
      busy = false;
      const next = waiting;
      waiting = null;
      if (next !== null) ask(...next);
    }
  };
}

/** Resolves after a while. */
export function after(milliseconds) {
  return new Promise((resolve) => setTimeout(resolve, milliseconds));
}

/** Resolves when the browser has nothing better to do, or after a while. */
export function idle() {
  const wait = globalThis.requestIdleCallback ?? setTimeout;
  return new Promise((resolve) => wait(() => resolve(), globalThis.requestIdleCallback ? { timeout: 1000 } : 0));
}
