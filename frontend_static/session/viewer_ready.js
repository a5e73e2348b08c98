/**
 * Whether viser has drawn a picture of the run. Its page is of our own origin, so what it holds can be looked at.
 */

import { after } from "../shared/timing.js";

const LOOK_EVERY_MS = 40;
const PATIENCE_MS = 3000;
/** The free space that the scene leaves around the picture, and how exactly it has to stand there. */
const MARGIN = 1.03;
const EXACT = 0.02;

/**
 * Resolves when the scene in a frame has been drawn, with its camera in place and nothing fading.
 *
 * @param {HTMLIFrameElement} frame
 * @param {() => boolean} isWanted Looking goes on as long as this holds.
 * @param {AbortSignal} signal Ends the looking, without an answer.
 * @returns {Promise<boolean>} False when it is not wanted any more.
 */
export async function viewerReady(frame, isWanted, signal) {
  let since = null;
  while (isWanted()) {
    const found = look(frame.contentWindow);
    if (found !== null) since ??= performance.now();
    // The camera is put in place by a message of its own; it is not when somebody has already turned it.
    if (found === "in place" || (since !== null && performance.now() - since > PATIENCE_MS)) {
      return isWanted();
    }
    await after(LOOK_EVERY_MS, signal);
  }
  return false;
}

/** @returns {null|"there"|"in place"} What there is of the run in the scene. */
function look(window) {
  const { nodeRefFromName: nodes, camera } = window?.__viserMutable ?? {};
  if (!nodes || !camera) return null;
  const picture = nodes["/picture"];
  if (picture) {
    let image = null;
    picture.traverse((item) => {
      image = (item.isMesh && item.material.map?.image) || image;
    });
    if (!image?.width) return null;
    const distance = picture.getWorldPosition(camera.position.clone()).distanceTo(camera.position);
    const seen = distance * Math.tan((camera.fov * Math.PI) / 360);
    const wanted = (MARGIN * Math.max(image.height, image.width / camera.aspect)) / 2;
    return Math.abs(seen / wanted - 1) < EXACT && isOpaque(window) ? "in place" : "there";
  }
  // A drawing without a picture, or with its picture switched off.
  for (const [name, node] of Object.entries(nodes)) {
    let found = false;
    if (name !== "" && name !== "/WorldAxes") node?.traverse((item) => (found ||= item.isPoints || item.isLineSegments2));
    if (found) return "there";
  }
  return null;
}

/** viser fades its canvas in. */
function isOpaque(window) {
  const canvas = window.document.querySelector("canvas[data-engine]");
  return canvas === null || Number(window.getComputedStyle(canvas).opacity) > 0.99;
}
