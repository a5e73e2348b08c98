/**
 * Which frames the plots of a session show: all, or those that somebody looks at more closely. The wheel with Ctrl, or two
 * fingers on a touchpad, zoom at the pointer; dragging moves what is zoomed; a double click shows all again. The keys +, - and
 * 0 do the same at the frame that is shown.
 */

/** @typedef {[low: number, high: number]} Frames */

/**
 * What is to be known of the plots.
 *
 * @typedef {object} Plotted
 * @property {(event: MouseEvent) => {x: number, perPx: number}|null} at Which frame lies under the pointer, and how many in a px.
 * @property {() => number} position Of the frame that is shown.
 * @property {() => void} changed Is called after each change.
 */

/** So much nearer for so many px of the wheel. */
const RATE = 1 / 300;
/** And for a key. */
const STEP = 2;
/** So few frames are never widened further. */
const FEWEST = 4;
const MOVED_PX = 4;

export class Zoom {
  #plotted;
  /** @type {Frames|null} */
  #window = null;
  #last = 1;
  /** Whether the pointer that went down last has moved the window. */
  #isMoved = false;

  /**
   * @param {HTMLElement} place Has the plots in it, and can have the focus.
   * @param {Plotted} plotted
   * @param {AbortSignal} signal
   */
  constructor(place, plotted, signal) {
    this.#plotted = plotted;
    place.addEventListener("wheel", (event) => this.#wheel(event), { passive: false, signal });
    place.addEventListener("dblclick", () => this.#set(null), { signal });
    place.addEventListener("keydown", (event) => this.#key(event), { signal });
    place.addEventListener("pointerdown", (event) => this.#drag(event), { signal });
    place.addEventListener("click", (event) => this.#click(event), { capture: true, signal });
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

  /** @param {WheelEvent} event */
  #wheel(event) {
    const found = event.ctrlKey || event.metaKey ? this.#plotted.at(event) : null;
    if (found === null) return;
    event.preventDefault();
    this.#set(scaled(this.within(this.#last), found.x, Math.exp(event.deltaY * RATE)));
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    const factor = { "+": 1 / STEP, "=": 1 / STEP, "-": STEP }[event.key];
    if (event.ctrlKey || event.metaKey || event.altKey || (factor === undefined && event.key !== "0")) return;
    event.preventDefault();
    event.stopPropagation();
    this.#set(factor === undefined ? null : scaled(this.within(this.#last), this.#plotted.position(), factor));
  }

  /** @param {MouseEvent} event */
  #click(event) {
    // What was dragged was not chosen.
    if (this.#isMoved) event.stopImmediatePropagation();
    this.#isMoved = false;
  }

  /** @param {PointerEvent} begun */
  #drag(begun) {
    this.#isMoved = false;
    const [window, held] = [this.#window, this.#plotted.at(begun)];
    if (window === null || held === null || begun.button !== 0 || begun.pointerType === "touch") return;
    const end = new AbortController();
    const move = (/** @type {PointerEvent} */ event) => {
      const px = event.clientX - begun.clientX;
      this.#isMoved ||= Math.abs(px) >= MOVED_PX;
      if (this.#isMoved) this.#set([window[0] - px * held.perPx, window[1] - px * held.perPx]);
    };
    document.addEventListener("pointermove", move, { signal: end.signal });
    for (const type of /** @type {const} */ (["pointerup", "pointercancel"])) document.addEventListener(type, () => end.abort(), { signal: end.signal });
  }

  /** @param {Frames|null} window */
  #set(window) {
    this.#window = window && clamped(window, this.#last);
    this.#plotted.changed();
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
