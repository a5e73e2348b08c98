// Colours of vertices. viser draws a mesh in one colour only and updates its vertices in place; it takes a mesh with vertex colours as a
// file, which it reads in the background, showing nothing meanwhile. So the colours are sent separately, as those of hidden points
// (`viser_handles.py`), and copied to the vertices just before a picture is drawn.
const SUFFIX = " colours";
const COMPONENTS = 4;
const LINEAR = Float32Array.from({ length: 256 }, (_, value) => {
  const srgb = value / 255;
  return srgb <= 0.04045 ? srgb / 12.92 : ((srgb + 0.055) / 1.055) ** 2.4;
});
/** @type {WeakMap<ViserGeometry, Uint8Array>} */
const taken = new WeakMap();

/** @type {(node: ViserNode) => node is ViserMesh} */
const isMesh = (node) => node.isMesh === true;
/** @type {(node: ViserNode) => node is ViserPoints} */
const isPoints = (node) => node.isPoints === true;

/**
 * @template {ViserNode} Kind
 * @param {ViserNode|null|undefined} node
 * @param {(node: ViserNode) => node is Kind} isOfKind
 */
const first = (node, isOfKind) => {
  /** @type {Kind[]} */
  const found = [];
  node?.traverse((item) => isOfKind(item) && found.push(item));
  return found[0];
};

/**
 * @param {Float32Array} colours
 * @param {Uint8Array} bytes Red, green and blue of all vertices, one after the other, and then all opacities.
 * @param {number} count Number of vertices.
 */
const fill = (colours, bytes, count) => {
  for (let vertex = 0; vertex < count; vertex += 1) {
    for (let channel = 0; channel < 3; channel += 1) colours[COMPONENTS * vertex + channel] = LINEAR[bytes[3 * vertex + channel]];
    colours[COMPONENTS * vertex + 3] = bytes[3 * count + vertex] / 255;
  }
};

/**
 * @param {ViserMesh} mesh
 * @param {Uint8Array} bytes
 */
const dress = ({ geometry, material }, bytes) => {
  if (!material.vertexColors) {
    material.vertexColors = true;
    material.needsUpdate = true;
  }
  const { position, color } = geometry.attributes;
  if (taken.get(geometry) === bytes || bytes.length < COMPONENTS * position.count) return;
  taken.set(geometry, bytes);
  const values = color?.count === position.count ? color : new position.constructor(new Float32Array(COMPONENTS * position.count), COMPONENTS);
  fill(values.array, bytes, position.count);
  values.needsUpdate = true;
  if (values !== color) geometry.setAttribute("color", values);
};

const dressAll = () => {
  const nodes = window.__viserMutable?.nodeRefFromName ?? {};
  for (const name of Object.keys(nodes)) {
    if (!name.endsWith(SUFFIX)) continue;
    const mesh = first(nodes[name.slice(0, -SUFFIX.length)], isMesh);
    const bytes = first(nodes[name], isPoints)?.geometry.attributes.color?.array;
    if (mesh && bytes) dress(mesh, bytes);
  }
};

const begin = () => {
  const scene = window.__viserMutable?.scene;
  if (scene) scene.onBeforeRender = dressAll;
  else requestAnimationFrame(begin);
};
begin();
