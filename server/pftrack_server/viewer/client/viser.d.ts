/** The parts of viser's client, and of three.js in it, that the scripts next to this file use. */

interface ViserVector {
  x: number;
  y: number;
  z: number;
  clone(): ViserVector;
  project(camera: ViserCamera): ViserVector;
  set(x: number, y: number, z: number): ViserVector;
  unproject(camera: ViserCamera): ViserVector;
}

interface ViserPicture {
  src: string;
  width: number;
  height: number;
}

/** An attribute of vertices: a fixed number of values for each, one after the other. */
interface ViserAttribute<Values extends Float32Array | Uint8Array = Float32Array> {
  array: Values;
  count: number;
  needsUpdate: boolean;
  constructor: new (values: Values, size: number) => ViserAttribute<Values>;
}

interface ViserGeometry {
  attributes: { position: ViserAttribute; color?: ViserAttribute };
  boundingBox: { min: ViserVector; max: ViserVector };
  computeBoundingBox(): void;
  setAttribute(name: string, attribute: ViserAttribute): void;
}

interface ViserMaterial {
  isMeshBasicMaterial?: boolean;
  map?: { image?: ViserPicture | null } | null;
  vertexColors: boolean;
  needsUpdate: boolean;
}

interface ViserMesh extends ViserNode {
  isMesh: true;
  geometry: ViserGeometry;
  material: ViserMaterial;
}

interface ViserPoints extends ViserNode {
  isPoints: true;
  /** viser keeps the received bytes of their colours. */
  geometry: { attributes: { position: ViserAttribute; color?: ViserAttribute<Uint8Array> } };
}

interface ViserNode {
  isLineSegments2?: boolean;
  isMesh?: boolean;
  isPoints?: boolean;
  /** Only on drawn objects. */
  material?: ViserMaterial;
  /** Called on a scene just before a picture is drawn. */
  onBeforeRender?(): void;
  parent?: ViserNode | null;
  position: ViserVector;
  visible?: boolean;
  localToWorld(place: ViserVector): ViserVector;
  worldToLocal(place: ViserVector): ViserVector;
  traverse(visit: (node: ViserNode) => void): void;
}

interface ViserCamera {
  position: ViserVector;
}

interface Window {
  __viserMutable?: {
    camera?: ViserCamera;
    cameraControl?: { distance: number };
    configuredMaxOrbitDistance?: number;
    messageQueue: unknown[];
    nodeRefFromName?: Record<string, ViserNode | null | undefined>;
    scene?: ViserNode;
    drainMessageQueue?(): void;
    requestRender(): void;
  };
}
