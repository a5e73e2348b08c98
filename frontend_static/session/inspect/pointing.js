/** Pointing at the picture by pointer, in a flat view and in the 3-D scene, or by keys; in pixels of the picture. */

/** @import { Scene } from "../scene.js" */

/**
 * @typedef {object} Pointer
 * @property {(at: [number, number]) => unknown} hover
 * @property {(at: [number, number], particle?: [number, number]) => unknown} press With the place of the particle that was hit, where
 *     that is another one, as of one that is lifted above the picture.
 * @property {(across: number, down: number) => unknown} move By keys, px.
 * @property {() => unknown} take The nearest particle.
 */

const FAR = 10;
/** @type {Record<string, [number, number]>} */
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

/**
 * @param {Scene|null} scene Where the picture is; without one there are the keys.
 * @param {HTMLElement} pad What has the focus while keys point.
 * @param {Pointer} on
 * @param {AbortSignal} signal
 */
export function pointing(scene, pad, on, signal) {
  const pointed = (/** @type {(at: [number, number]) => unknown} */ tell) => (/** @type {Event} */ event) => {
    const at = event instanceof MouseEvent ? placeOf(event) : null;
    if (at !== null) tell(at);
  };
  scene?.root.addEventListener("pointermove", pointed(on.hover), { signal });
  scene?.root.addEventListener("click", pointed(on.press), { signal });
  globalThis.addEventListener("message", ({ origin, source, data }) => {
    if (origin !== location.origin || !scene?.window || source !== scene.window || data?.source !== "pftrack-viser") return;
    const place = placeIn(data.place);
    if (place === null) return;
    if (data.pointed === "hover") on.hover(place);
    else if (data.pointed === "press") on.press(place, placeIn(data.particle) ?? undefined);
  }, { signal });
  pad.addEventListener("keydown", (event) => {
    const arrow = ARROWS[event.key];
    if (arrow === undefined && event.key !== "Enter") return;
    // They are no steps of the run.
    event.preventDefault();
    const step = event.shiftKey ? FAR : 1;
    if (arrow === undefined) on.take();
    else on.move(step * arrow[0], step * arrow[1]);
  }, { signal });
}

/**
 * Where a pointer is in the picture, px; its origin is the centre of the first pixel.
 *
 * @param {MouseEvent} event
 * @returns {[number, number]|null}
 */
function placeOf({ target, offsetX, offsetY }) {
  if (!(target instanceof HTMLElement) || !target.classList.contains("flat-canvas")) return null;
  const scale = target.offsetWidth / Number(target.dataset.width);
  return Number.isFinite(scale) && scale > 0 ? [offsetX / scale - 0.5, offsetY / scale - 0.5] : null;
}

/**
 * @param {unknown} said
 * @returns {[number, number]|null}
 */
function placeIn(said) {
  if (!Array.isArray(said)) return null;
  const [x, y] = said.map(Number);
  return Number.isFinite(x) && Number.isFinite(y) ? [x, y] : null;
}
