// What the page around may know of the scene, without knowing how viser keeps it: `pftrackScene.drawn()`.
//
// The free space that the front preset leaves around the picture (`camera.fit`), and how exactly it has to stand there.
const MARGIN = 1.03;
const EXACT = 0.02;
const DRAWN_BY_NOBODY = new Set(["", "/WorldAxes"]); // viser's own nodes

const textureOf = (node) => {
  let image = null;
  node.traverse((item) => (image = (item.isMesh && item.material.map?.image) || image));
  return image?.width ? image : null;
};
const hasContent = (node) => {
  let found = false;
  node.traverse((item) => (found ||= item.isPoints || item.isLineSegments2 || item.isMesh));
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
  const picture = nodes["/picture"];
  if (!picture) {
    // A drawing without a picture, or with its picture switched off.
    const drawing = Object.entries(nodes).filter(([name]) => !DRAWN_BY_NOBODY.has(name));
    return drawing.some(([, node]) => node && hasContent(node)) ? "there" : null;
  }
  const image = textureOf(picture);
  if (image === null) return null;
  const distance = picture.getWorldPosition(camera.position.clone()).distanceTo(camera.position);
  const seen = distance * Math.tan((camera.fov * Math.PI) / 360);
  const wanted = (MARGIN * Math.max(image.height, image.width / camera.aspect)) / 2;
  return Math.abs(seen / wanted - 1) < EXACT && isOpaque() ? "in place" : "there";
};

window.pftrackScene = Object.freeze({ drawn });
