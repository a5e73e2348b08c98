// What the page around may know of the scene, without knowing how viser keeps it: `pftrackScene.drawn()`, and which frame
// it shows, which is where a node stands that nobody sees.
//
// The free space that the front preset leaves around the picture (`camera.fit`), and how exactly it has to stand there.
const MARGIN = 1.03;
const EXACT = 0.02;
const DRAWN_BY_NOBODY = new Set(["", "/WorldAxes", "/frame"]); // viser's own nodes, and ours without content

// A picture is a plane without light; it has no image while that is being unpacked. Meshes are lit.
const planesOf = (/** @type {ViserNode} */ node) => {
  /** @type {ViserNode[]} */
  const planes = [];
  node.traverse((item) => item.isMesh && item.material?.isMeshBasicMaterial && planes.push(item));
  return planes;
};
const hasContent = (/** @type {ViserNode} */ node) => {
  let found = false;
  node.traverse((item) => (found ||= Boolean(item.isPoints || item.isLineSegments2 || item.isMesh)));
  return found;
};
// viser fades its canvas in.
const isOpaque = () => {
  const canvas = document.querySelector("canvas[data-engine]");
  return canvas === null || Number(getComputedStyle(canvas).opacity) > 0.99;
};

/** @returns {null|"there"|"in place"} What there is of the run; "in place" once the camera frames the whole picture. */
const drawn = () => {
  const { nodeRefFromName: nodes, camera } = window.__viserMutable ?? {};
  if (!nodes || !camera) return null;
  const drawing = Object.entries(nodes).flatMap(([name, node]) => (node && !DRAWN_BY_NOBODY.has(name) ? [node] : []));
  const [plane] = drawing.flatMap(planesOf);
  if (!plane) return drawing.some(hasContent) ? "there" : null;
  const image = plane.material?.map?.image;
  if (!image?.width) return null;
  const distance = plane.getWorldPosition(camera.position.clone()).distanceTo(camera.position);
  const seen = distance * Math.tan((camera.fov * Math.PI) / 360);
  const wanted = (MARGIN * Math.max(image.height, image.width / camera.aspect)) / 2;
  return Math.abs(seen / wanted - 1) < EXACT && isOpaque() ? "in place" : "there";
};

window.pftrackScene = Object.freeze({ drawn, frame: () => window.__viserMutable?.nodeRefFromName?.["/frame"]?.position.x ?? null });
