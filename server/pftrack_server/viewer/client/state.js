// The scene's state for the outer page, independent of viser's internals: `pftrackScene.drawn()`, and the shown frame, which is the
// position of an invisible node.
// Largest distance from the target point, in distances of the preset (`camera.Cameras`); viser's own limit applies until it is set. And the
// tolerance of the camera's position.
const FURTHEST = 10;
const UNTOLD = 1e4;
const EXACT = 0.02;
const DRAWN_BY_NOBODY = new Set(["", "/WorldAxes", "/frame"]); // viser's own nodes, and ours without content

// A picture is an unlit plane, without an image while that is being decoded. Meshes are lit.
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

/** @returns {null|"there"|"in place"} State of the run's picture; "in place" once the camera is at its preset. */
const drawn = () => {
  const { nodeRefFromName: nodes, cameraControl, configuredMaxOrbitDistance: furthest = UNTOLD } = window.__viserMutable ?? {};
  if (!nodes || !cameraControl) return null;
  const drawing = Object.entries(nodes).flatMap(([name, node]) => (node && !DRAWN_BY_NOBODY.has(name) ? [node] : []));
  const [plane] = drawing.flatMap(planesOf);
  if (!plane) return drawing.some(hasContent) ? "there" : null;
  if (!plane.material?.map?.image?.width) return null;
  const isThere = furthest !== UNTOLD && Math.abs((FURTHEST * cameraControl.distance) / furthest - 1) < EXACT;
  return isThere && isOpaque() ? "in place" : "there";
};

window.pftrackScene = Object.freeze({ drawn, frame: () => window.__viserMutable?.nodeRefFromName?.["/frame"]?.position.x ?? null });
