/** Who descends from whom: generations to the right, a line from each particle to its parent. */

import { nearestOf } from "../polyline.js";
import { stroke } from "../canvas.js";
import { saying } from "../description.js";

/** @import { Tree } from "../traces.js" */
/** @import { Hit, Sheet } from "../canvas.js" */

const NODE = 3;
const FAINTEST = 0.12;
const LEVELS = 8;

/**
 * @param {Sheet} sheet
 * @param {Tree} tree
 */
export function paint(sheet, tree) {
  const { pen, x, y } = sheet;
  /** @type {{links: Path2D, nodes: Path2D}[]} */
  const steps = Array.from({ length: LEVELS + 1 }, () => ({ links: new Path2D(), nodes: new Path2D() }));
  const radius = Math.min(NODE * sheet.unit, Math.abs(y.at(1) - y.at(0)) * 0.4);
  tree.parents.forEach((row, generation) => {
    row.forEach((parent, particle) => {
      const weight = Math.min(Math.max(tree.weights[generation]?.[particle] ?? 0, 0), 1);
      const { links, nodes } = steps[Math.round(weight * LEVELS)];
      const [atX, atY] = [x.at(generation), y.at(particle)];
      nodes.moveTo(atX + radius, atY);
      nodes.arc(atX, atY, radius, 0, 2 * Math.PI);
      if (parent === null) return;
      links.moveTo(x.at(generation - 1), y.at(parent));
      links.lineTo(atX, atY);
    });
  });
  pen.save();
  pen.fillStyle = sheet.ink[tree.ink];
  steps.forEach(({ links, nodes }, step) => {
    pen.globalAlpha = FAINTEST + (1 - FAINTEST) * (step / LEVELS);
    stroke(sheet, links, tree.ink, { solid: 1.25 });
    pen.fill(nodes);
  });
  pen.restore();
}

/**
 * @param {Sheet} sheet
 * @param {Tree} tree
 * @param {number} px
 * @param {number} py
 * @returns {Hit|null}
 */
export function near(sheet, tree, px, py) {
  const generation = Math.round(sheet.x.value(px));
  const parents = tree.parents[generation];
  if (parents === undefined) return null;
  const rows = Float64Array.from(parents.keys(), (row) => sheet.y.at(row));
  const hit = nearestOf(rows.map(() => sheet.x.at(generation)), rows, px, py);
  if (hit === null) return null;
  const parent = parents[hit.index];
  const descent = parent === null ? "" : `child of ${parent + 1}`;
  return { ...hit, words: saying(tree, `particle ${hit.index + 1} of generation ${generation}`, descent) };
}

/**
 * @param {Tree} tree
 * @returns {Tree} For the key: one parent, two children.
 */
export function sample(tree) {
  return { ...tree, parents: [[null, null], [0, 0]], weights: [[1, 0], [1, 1]] };
}
