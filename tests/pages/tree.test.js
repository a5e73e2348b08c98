import assert from "node:assert/strict";
import { describe, it } from "node:test";

import { History } from "../../frontend_static/session/history.js";
import { edges, nodes, wayBack } from "../../frontend_static/session/plots/kinds/tree.js";

const rows = [
  { values: [[0]], weights: [1], parents: [-1] },
  { values: [[0], [1]], weights: [0.75, 0.25], parents: [0, 0] },
  { values: [[0], [1]], weights: [0.4, 0.6], parents: [0, 1] },
];

function history(...hypotheses) {
  const made = new History();
  hypotheses.forEach((tree, frame) => made.add({ frame, estimate: [0], series: { tree } }));
  return made;
}

describe("a tree of hypotheses", () => {
  it("has a node for each, the first in row 1, the more opaque the more probable", () => {
    const found = nodes(history(...rows), 1, "tree");
    assert.deepEqual([found.frame, found.place], [[1, 1, 2, 2], [1, 2, 1, 2]]);
    assert.ok(found.alpha[0] > found.alpha[3] && found.alpha[1] > 0.12);
  });

  it("has an edge from each parent, and none where a hypothesis begins", () => {
    const found = edges(history(...rows), 0, "tree");
    assert.deepEqual([found.frame, found.y0, found.x1, found.y1], [[0, 0, 1, 1], [1, 1, 1, 2], [1, 1, 2, 2], [1, 2, 1, 2]]);
  });

  it("leads back from the most probable of the newest frame", () => {
    assert.deepEqual(wayBack(history(...rows), "tree"), { frame: [2, 1, 0], place: [2, 2, 1] });
    const begun = [...rows.slice(0, 2), { values: [[0]], weights: [1], parents: [-1] }];
    assert.deepEqual(wayBack(history(...begun), "tree"), { frame: [2], place: [1] });
  });

  it("is empty where nobody has hypotheses, and has no way back where their parents are not known", () => {
    assert.deepEqual(wayBack(history(undefined, undefined), "tree"), { frame: [], place: [] });
    assert.deepEqual(wayBack(history({ values: [[0]], weights: [1] }, { values: [[0]], weights: [1] }), "tree"), { frame: [1], place: [1] });
    assert.deepEqual(edges(history({ values: [[0]], weights: [1] }), 0, "tree").frame, []);
  });
});
