/**
 * Which frames the plots of a session show: all, or those that somebody looks at more closely. The wheel with Ctrl, or two
 * fingers on a touchpad, zoom at the pointer; dragging moves what is zoomed; a double click shows all again. The keys +, - and
 * 0 do the same at the frame that is shown.
 */

/** @typedef {[low: number, high: number]} Frames */

/** So much nearer for so many px of the wheel. */
const RATE = 1 / 300;
/** And for a key. */
const STEP = 2;
/** So few frames are never widened further. */
const FEWEST = 4;
const MOVED_PX = 4;

export class Zoom {
  #changed;
  /** @type {Frames|null} */
  #window = null;
  #last = 1;

  /** @param {() => void} changed Is called after each change. */
  constructor(changed) {
    this.#changed = changed;
  }

  /**
   * The frames that are seen.
   *
   * @param {number} last Number of the last frame.
   * @returns {Frames}
   */
  within(last) {
    this.#last = last;
    if (this.#window !== null && this.#window[1] > last) this.#window = clamped(this.#window, last);
    return this.#window ?? [0, last];
  }

  /**
   * Take what a person does in a plot.
   *
   * @param {HTMLElement} place
   * @param {(event: MouseEvent) => number|null} frameAt Which frame lies under the pointer.
   * @param {AbortSignal} signal
   */
  listen(place, frameAt, signal) {
    place.addEventListener(
      "wheel",
      (event) => {
        const at = event.ctrlKey || event.metaKey ? frameAt(event) : null;
        if (at === null) return;
        event.preventDefault();
        this.#set(scaled(this.within(this.#last), at, Math.exp(event.deltaY * RATE)));
      },
      { passive: false, signal },
    );
    place.addEventListener("dblclick", () => this.#set(null), { signal });
    place.addEventListener(
      "pointerdown",
      (event) => {
        if (this.#window !== null && event.button === 0 && event.pointerType !== "touch") this.#drag(place, event, frameAt);
      },
      { signal },
    );
  }

  /**
   * Take the keys + and -, and 0 for all frames.
   *
   * @param {HTMLElement} root
   * @param {() => number} position Of the frame that is shown.
   * @param {AbortSignal} signal
   */
  listenToKeys(root, position, signal) {
    root.addEventListener(
      "keydown",
      (event) => {
        if (event.ctrlKey || event.metaKey || event.altKey) return;
        const factor = { "+": 1 / STEP, "=": 1 / STEP, "-": STEP }[event.key];
        if (factor === undefined && event.key !== "0") return;
        event.preventDefault();
        event.stopPropagation();
        this.#set(factor === undefined ? null : scaled(this.within(this.#last), position(), factor));
      },
      { signal },
    );
  }

  /**
   * @param {HTMLElement} place
   * @param {PointerEvent} begun
   * @param {(event: MouseEvent) => number|null} frameAt
   */
  #drag(place, begun, frameAt) {
    const held = frameAt(begun);
    const window = this.#window;
    const perPx = (Number(frameAt(/** @type {MouseEvent} */ ({ clientX: begun.clientX + 1, clientY: begun.clientY }))) - Number(held)) || 0;
    if (held === null || window === null) return;
    const end = new AbortController();
    let isMoved = false;
    place.setPointerCapture(begun.pointerId);
    const move = (/** @type {PointerEvent} */ event) => {
      const px = event.clientX - begun.clientX;
      isMoved ||= Math.abs(px) >= MOVED_PX;
      if (isMoved) this.#set([window[0] - px * perPx, window[1] - px * perPx]);
    };
    place.addEventListener("pointermove", move, { signal: end.signal });
    for (const type of /** @type {const} */ (["pointerup", "pointercancel"])) place.addEventListener(type, () => end.abort(), { signal: end.signal });
    // What was dragged was not chosen.
    place.addEventListener("click", (event) => isMoved && event.stopImmediatePropagation(), { capture: true, once: true });
  }

  /** @param {Frames|null} window */
  #set(window) {
    this.#window = window && clamped(window, this.#last);
    this.#changed();
  }
}

/**
 * A window widened or narrowed around a frame.
 *
 * @param {Frames} window
 * @param {number} at
 * @param {number} factor Above 1 to see more.
 * @returns {Frames}
 */
export function scaled([low, high], at, factor) {
  const wanted = Math.max(FEWEST, (high - low) * factor);
  const real = wanted / (high - low || 1);
  return [at - (at - low) * real, at + (high - at) * real];
}

/**
 * The nearest window within the frames that there are; null if it has all.
 *
 * @param {Frames} window
 * @param {number} last
 * @returns {Frames|null}
 */
export function clamped([low, high], last) {
  const span = high - low;
  if (span >= last) return null;
  const start = Math.min(Math.max(0, low), last - span);
  return [start, start + span];
}
