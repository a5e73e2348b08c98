// Pointing at the scene: the outer page receives the pointer's place in the picture, and clicks.
// A click on a particle also sends the particle's place: one raised above the picture is not where it seems to be.
const STILL_PX = 4; // a pointer that moves further has turned the scene
const NEAR_PX = 8;
const around = location.origin === "null" ? "*" : location.origin;
/** @typedef {[number, number]} Place */

/** @returns {ViserMesh|null} The plane that shows the picture. */
const pictureOf = () => {
  /** @type {ViserMesh|null} */
  let plane = null;
  window.__viserMutable?.nodeRefFromName?.["/picture"]?.traverse((item) => {
    if (item.isMesh && item.material?.map?.image) plane = /** @type {ViserMesh} */ (item);
  });
  return plane;
};
const isShown = (/** @type {ViserNode|null|undefined} */ node) => {
  for (let item = node; item; item = item.parent) if (item.visible === false) return false;
  return true;
};

/**
 * Where a ray from the camera meets the picture, px of the picture; its origin is the centre of the first pixel.
 *
 * @param {Place} at Place in the canvas, -1 to 1 from left to right and from the bottom to the top.
 * @returns {Place|null}
 */
const placeAt = ([across, up]) => {
  const plane = pictureOf();
  const camera = window.__viserMutable?.camera;
  const image = plane?.material.map?.image;
  if (!plane || !camera || !image) return null;
  const from = plane.worldToLocal(camera.position.clone());
  const to = plane.worldToLocal(camera.position.clone().set(across, up, 0.5).unproject(camera));
  const reach = from.z / (from.z - to.z);
  if (!(reach > 0)) return null;
  const [x, y] = [from.x + reach * (to.x - from.x), from.y + reach * (to.y - from.y)];
  plane.geometry.computeBoundingBox();
  const { min, max } = plane.geometry.boundingBox;
  const [column, row] = [((x - min.x) / (max.x - min.x)) * image.width, ((max.y - y) / (max.y - min.y)) * image.height];
  const isInside = column >= 0 && column < image.width && row >= 0 && row < image.height;
  return isInside ? [column - 0.5, row - 0.5] : null;
};

/** The place of the visible point nearest to a click, px of the picture; null if none is near.
 *
 * @param {Place} at Place in the canvas, -1 to 1.
 * @param {DOMRect} canvas
 * @returns {Place|null}
 */
const pointAt = ([across, up], { width, height }) => {
  const { camera, nodeRefFromName } = window.__viserMutable ?? {};
  const image = pictureOf()?.material.map?.image;
  if (!camera || !nodeRefFromName || !image) return null;
  const seen = camera.position.clone();
  let least = NEAR_PX;
  /** @type {Place|null} */
  let found = null;
  const look = (/** @type {ViserNode} */ item) => {
    if (!item.isPoints || !isShown(item)) return;
    const { array, count } = /** @type {ViserPoints} */ (item).geometry.attributes.position;
    for (let n = 0; n < count; n += 1) {
      const [x, y, z] = [array[3 * n], -array[3 * n + 1], array[3 * n + 2]];
      // Points of a world next to the picture are not particles.
      if (x < -0.5 || y < -0.5 || x > image.width - 0.5 || y > image.height - 0.5) continue;
      item.localToWorld(seen.set(x, -y, z)).project(camera);
      const off = Math.hypot(((seen.x - across) * width) / 2, ((seen.y - up) * height) / 2);
      if (off < least) [least, found] = [off, [x, y]];
    }
  };
  for (const node of Object.values(nodeRefFromName)) node?.traverse(look);
  return found;
};

/** @type {Place|null} */
let begun = null;
addEventListener("pointerdown", (event) => (begun = event.button === 0 ? [event.clientX, event.clientY] : null), true);
const tell = (/** @type {"hover"|"press"} */ pointed) => (/** @type {MouseEvent} */ event) => {
  if (parent === window || !(event.target instanceof Element && event.target.matches("canvas"))) return;
  if (pointed === "hover" && event.buttons !== 0) return;
  if (pointed === "press" && (!begun || Math.hypot(event.clientX - begun[0], event.clientY - begun[1]) > STILL_PX)) return;
  const canvas = event.target.getBoundingClientRect();
  /** @type {Place} */
  const at = [(2 * (event.clientX - canvas.left)) / canvas.width - 1, 1 - (2 * (event.clientY - canvas.top)) / canvas.height];
  const particle = pointed === "press" ? pointAt(at, canvas) : null;
  const place = placeAt(at) ?? particle;
  if (place !== null) parent.postMessage({ source: "pftrack-viser", pointed, place, particle }, around);
};
addEventListener("pointermove", tell("hover"), { capture: true, passive: true });
addEventListener("pointerup", tell("press"), true);
