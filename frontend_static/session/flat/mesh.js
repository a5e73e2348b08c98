/**
 * Painting meshes: triangles from the furthest to the nearest, shaded by how far they face the viewer, each in the mean
 * colour of its corners. What lies behind a triangle of the same mesh is not seen through it.
 */

import { css, placed } from "./pixels.js";

/** @import { Mesh } from "./decode.js" */
/** @import { Surface } from "./paint.js" */

/** What a triangle seen from its edge keeps of its colour. */
const AMBIENT = 0.4;
/** Triangles overlap by so many pixels of the canvas, so that nothing shines through between them. */
const OVERLAP_PX = 0.5;

/**
 * @param {Surface} surface
 * @param {Mesh} mesh
 */
export function paintMesh({ context, width, height, scale }, mesh) {
  const { vertices, faces } = mesh;
  if (!faces.length || !vertices.every(Number.isFinite)) return;
  const layer = new OffscreenCanvas(width, height);
  const target = layer.getContext("2d");
  if (target === null) return;
  target.lineWidth = OVERLAP_PX;
  target.lineJoin = "round";
  const { opacity } = mesh;
  for (const face of fromFarToNear(vertices, faces)) {
    const [a, b, c] = [faces[3 * face], faces[3 * face + 1], faces[3 * face + 2]];
    const light = AMBIENT + (1 - AMBIENT) * facing(vertices, a, b, c);
    target.fillStyle = target.strokeStyle = css(colourOf(mesh, a, b, c).map((value) => value * light));
    target.beginPath();
    for (const corner of [a, b, c]) target.lineTo(placed(vertices[3 * corner], scale), placed(vertices[3 * corner + 1], scale));
    target.closePath();
    if (typeof opacity !== "number") {
      target.globalCompositeOperation = "destination-out";
      target.globalAlpha = 1;
      target.fill();
      target.globalCompositeOperation = "source-over";
      target.globalAlpha = (opacity[a] + opacity[b] + opacity[c]) / 3;
      target.fill();
      continue;
    }
    target.fill();
    target.stroke();
  }
  context.globalAlpha = typeof opacity === "number" ? opacity : 1;
  context.drawImage(layer, 0, 0);
  context.globalAlpha = 1;
}

/**
 * @param {Float32Array} vertices
 * @param {Int32Array} faces
 * @returns {number[]} Numbers of the faces.
 */
function fromFarToNear(vertices, faces) {
  const heights = Array.from({ length: faces.length / 3 }, (_, face) =>
    [0, 1, 2].reduce((sum, corner) => sum + vertices[3 * faces[3 * face + corner] + 2], 0),
  );
  return [...heights.keys()].sort((one, other) => heights[one] - heights[other]);
}

/**
 * Share of a triangle's normal that points to the viewer, whichever side is seen.
 *
 * @param {Float32Array} vertices
 * @param {number} a
 * @param {number} b
 * @param {number} c
 */
function facing(vertices, a, b, c) {
  const edge = (/** @type {number} */ to, /** @type {number} */ axis) => vertices[3 * to + axis] - vertices[3 * a + axis];
  const x = edge(b, 1) * edge(c, 2) - edge(b, 2) * edge(c, 1);
  const y = edge(b, 2) * edge(c, 0) - edge(b, 0) * edge(c, 2);
  const z = edge(b, 0) * edge(c, 1) - edge(b, 1) * edge(c, 0);
  return Math.abs(z) / Math.max(Math.hypot(x, y, z), 1e-12);
}

/**
 * @param {Mesh} mesh
 * @param {number} a
 * @param {number} b
 * @param {number} c
 * @returns {number[]}
 */
function colourOf({ colour }, a, b, c) {
  if (colour.length === 3) return [...colour];
  return [0, 1, 2].map((channel) => (colour[3 * a + channel] + colour[3 * b + channel] + colour[3 * c + channel]) / 3);
}
