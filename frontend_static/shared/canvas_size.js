/** How much room an element gives to a canvas within it, and how large things on it are. */

/** @typedef {{width: number, height: number}} CanvasSize pixels of the display */

/** What small things on canvases are drawn for, px: the letters of an element of the class `small-print`. */
const SMALL_PX = 11;

/**
 * How much larger what is drawn in an element of the class `small-print` has to be than where a page has its usual letters.
 *
 * @param {Element} element
 */
export function enlargement(element) {
  return parseFloat(getComputedStyle(element).fontSize) / SMALL_PX || 1;
}

/**
 * Call `changed` with the room that an element has, at once and after each change.
 *
 * @param {HTMLElement} element
 * @param {(room: CanvasSize) => void} changed
 * @param {AbortSignal} signal Ends it.
 */
export function watchCanvasSize(element, changed, signal) {
  const observer = new ResizeObserver(([{ devicePixelContentBoxSize: sizes, contentRect }]) => {
    const width = sizes?.[0]?.inlineSize ?? Math.round(contentRect.width * devicePixelRatio);
    const height = sizes?.[0]?.blockSize ?? Math.round(contentRect.height * devicePixelRatio);
    changed({ width, height });
  });
  signal.addEventListener("abort", () => observer.disconnect());
  try {
    observer.observe(element, { box: "device-pixel-content-box" });
  } catch {
    // Safari knows its pixels only roughly.
    observer.observe(element);
  }
}
