import assert from "node:assert/strict";
import { describe, it } from "node:test";

import { KINDS, treeOf } from "../../frontend_static/session/plots/kinds.js";
import { clamped, column, enclose, scaled, shades } from "../../frontend_static/session/plots/plots.js";
import { History } from "../../frontend_static/session/store.js";

function historyOf(errors) {
  const made = new History();
  errors.forEach((error, frame) => made.add({ frame, error, estimate: [error], hidden: error > 4, series: {} }));
  return made;
}

describe("a column", () => {
  it("reads of a history that has grown only the new frames", () => {
    const [asked, history] = [[], historyOf([1, 2])];
    const read = (row) => {
      asked.push(row.frame);
      return row.error;
    };
    column(history, read);
    history.add({ frame: 2, error: null, estimate: [0], series: {} });
    assert.deepEqual(column(history, read), [1, 2, NaN]);
    assert.deepEqual(asked, [0, 1, 2]);
  });

  it("is read anew once another run has taken the place of its own", () => {
    const [read, history] = [(row) => row.error, historyOf([9, 9, 9])];
    column(history, read);
    history.share(historyOf([1, 2]), 1);
    assert.deepEqual(column(history, read), [1, 2]);
  });
});

it("shades cover the frames of a state, and have its word where there is one", () => {
  const hidden = shades("hidden", 0.2, (row) => row.hidden, { word: "hidden" });
  const found = hidden(historyOf([1, 5, 6, 1]));
  assert.deepEqual([found.title, found.intervals, hidden(historyOf([1])).title], ["hidden", [{ first: 0.5, last: 2.5 }], ""]);
});

it("limits span at least the smallest useful range, so a nearly constant line looks flat", () => {
  for (const [low, high] of [[4.91083, 4.91083], [0, 0], [3.2, 3.3]]) {
    for (const smallest of [0.001, 1]) {
      const found = enclose([low, high], smallest);
      assert.ok(found.low <= low && found.high >= high && found.high - found.low >= smallest - 1e-12);
    }
  }
  assert.deepEqual(enclose([12, 87], 1), { low: 10, high: 90 });
});

it("zooming keeps the frame under the pointer, and never leaves the run", () => {
  assert.deepEqual(scaled([0, 100], 25, 0.5), [12.5, 62.5]);
  assert.deepEqual([[-10, 40], [80, 130], [-10, 200]].map((range) => clamped(range, 100)), [[0, 50], [50, 100], null]);
  const [first, last] = scaled([10, 12], 11, 0.01);
  assert.equal(last - first, 4);
});

describe("a kind of plot", () => {
  /** The traces of a plot of the only branch, by their names. */
  function drawn(kind, plot, ...rows) {
    const [branch, history] = [{ id: "b0", colour: "#123456" }, new History()];
    rows.forEach((series, frame) => history.add({ frame, estimate: [0], series }));
    const store = { history, historyOf: () => history, branches: [branch], known: { branch: "b0", branches: [branch], doubts: {}, frames: 9, thresholds: [] } };
    const session = { series: [{ name: "a", components: ["x", "y"] }] };
    const made = KINDS[kind]({ id: "p", title: "P", unit: "", truth: "t", component: 0, levels: [0.5], row_titles: [], ...plot, series: ["a"] }, session);
    return Object.fromEntries(made.show(store, true).traces.map((trace) => [trace.name, trace]));
  }

  it("draws hypotheses from frame to frame, the more opaque the more probable, new ones half a frame long", () => {
    const { p, "p truth": truth } = drawn("hypotheses", {}, { a: { values: [[3]], weights: [1] }, t: 3 }, { a: { values: [[4], [9]], weights: [0.75, 0.25] }, t: 5 });
    assert.deepEqual(p.links.map(({ x0, y0, x1, y1 }) => [x0, y0, x1, y1]), [[-0.5, 3, 0, 3], [0, 3, 1, 4], [0.5, 9, 1, 9]]);
    assert.deepEqual(p.links.map(({ opacity }) => Number(opacity.toFixed(3))), [1, 0.765, 0.295]);
    assert.deepEqual(truth.y, [3, 5]);
  });

  it("draws an interval between its ends, and a band of two standard deviations, beside the truth", () => {
    const both = [drawn("interval", {}, { a: [1, 2], t: 1.5 }, { a: [null, 3], t: 4 }), drawn("band", { sd: "s" }, { a: 7, s: 1, t: 8 }, { a: 5, s: 2, t: 4 })];
    assert.deepEqual(both.map((traces) => traces["p band 0"]).map(({ low, high }) => [low, high]), [[[1, NaN], [2, 3]], [[5, 1], [9, 9]]]);
    assert.deepEqual([...both.map((traces) => traces["p truth"].y), both[0]["p b0 high 0"].y, both[1]["p b0"].y], [[1.5, 4], [8, 4], [2, 3], [7, 5]]);
  });

  it("draws features in rows from the top, each from 0 at its bottom to 1 at its top, in the branch's colour", () => {
    const { "p x": first, "p y": second } = drawn("features", { recognised: "r", visible: "v" }, { a: [0, 0.5] }, { a: [1, 0] });
    assert.deepEqual([first.y, second.y, first.values, first.ink], [[0.88, 0.12], [1.5, 1.88], [0, 1], "#123456"]);
  });

  it("draws the share of frames so far in percent", () => {
    const { "p b0 a": share, "level 50": level } = drawn("frequency", {}, { a: [1, 0] }, { a: [1, 1] });
    assert.deepEqual([share.y, level.y], [[50, 75], [50, 50]]);
  });
});

describe("a tree of hypotheses", () => {
  const one = { values: [[0]], weights: [1], parents: [-1] };
  const rows = [one, ...[[0.75, 0.25, 0], [0.4, 0.6, 1]].map(([p, q, parent]) => ({ values: [[0], [1]], weights: [p, q], parents: [0, parent] }))];

  function found(...hypotheses) {
    const made = new History();
    hypotheses.forEach((tree, frame) => made.add({ frame, estimate: [0], series: { tree } }));
    return treeOf(made, "tree");
  }

  it("has a node for each, the more opaque the more probable, an edge from each parent, and a way back from the most probable", () => {
    const { nodes, links, way } = found(...rows);
    assert.deepEqual([nodes.x, nodes.y], [[0, 1, 1, 2, 2], [1, 1, 2, 1, 2]]);
    assert.ok(nodes.opacity[1] > nodes.opacity[4] && nodes.opacity[2] > 0.12);
    assert.deepEqual(links.map(({ x0, y0, x1, y1 }) => [x0, y0, x1, y1]), [[0, 1, 1, 1], [0, 1, 1, 2], [1, 1, 2, 1], [1, 2, 2, 2]]);
    assert.deepEqual([way, found(...rows.slice(0, 2), one).way], [{ x: [2, 1, 0], y: [2, 2, 1] }, { x: [2], y: [1] }]);
  });

  it("is empty where nobody has hypotheses, and has no way back where their parents are not known", () => {
    const alone = { values: [[0]], weights: [1] };
    assert.deepEqual([found(undefined, undefined).way, found(alone, alone).way, found(alone).links], [{ x: [], y: [] }, { x: [1], y: [1] }, []]);
  });
});
