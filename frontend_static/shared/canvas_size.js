/** How much room an element gives to a canvas within it. */

/** @typedef {{width: number, height: number}} CanvasSize pixels of the display */

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
