/** As much of viser's client, and of three.js in it, as the scripts beside this file use. */

interface ViserVector {
  clone(): ViserVector;
  distanceTo(other: ViserVector): number;
}

interface ViserPicture {
  src: string;
  width: number;
  height: number;
}

interface ViserNode {
  isLineSegments2?: boolean;
  isMesh?: boolean;
  isPoints?: boolean;
  /** Of what is drawn alone. */
  material?: { isMeshBasicMaterial?: boolean; map?: { image?: ViserPicture | null } | null };
  getWorldPosition(target: ViserVector): ViserVector;
  traverse(visit: (node: ViserNode) => void): void;
}

interface Window {
  __viserMutable?: {
    camera?: { aspect: number; fov: number; position: ViserVector };
    messageQueue: unknown[];
    nodeRefFromName?: Record<string, ViserNode | null | undefined>;
    scene?: ViserNode;
    drainMessageQueue?(): void;
    requestRender(): void;
  };
}
