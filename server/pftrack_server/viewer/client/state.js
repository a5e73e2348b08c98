// What the page around may know of the scene, without knowing how viser keeps it: `pftrackScene.drawn()`, and which frame
// it shows, which is where a node stands that nobody sees.
//
// As far as one may go from what is looked at, in distances of the preset (`camera.Cameras`); as long as nobody has said
// anything of it, viser has a limit of its own. And how exactly the camera has to stand there.
const FURTHEST = 10;
const UNTOLD = 1e4;
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

/** @returns {null|"there"|"in place"} What there is of the run; "in place" once the camera stands where the preset has it. */
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
