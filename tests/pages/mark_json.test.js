import assert from "node:assert/strict";
import { describe, it } from "node:test";

import { linesOf, markOf, valueAt } from "../../frontend_static/shared/marks/mark_json.js";

describe("the parts of a mark", () => {
  it("stand where their paths say, lists included", () => {
    const mark = markOf("line", [["ends.0", [1, 2]], ["ends.1", [3, 4]], ["style.width", 5], ["name", "x"]]);
    assert.deepEqual(mark, { kind: "line", ends: [[1, 2], [3, 4]], style: { width: 5 }, name: "x" });
    for (const [path, value] of [["ends.1", [3, 4]], ["style.width", 5], ["name", "x"]]) assert.deepEqual(valueAt(mark, path), value);
  });

  it("are missing where there is nothing", () => {
    assert.equal(valueAt(null, "a.b"), undefined);
    assert.equal(valueAt({ a: 1 }, "b.c"), undefined);
    assert.equal(valueAt({ points: {} }, "points.nose"), undefined);
  });
});

describe("the lines of a mark", () => {
  const handles = ["a", "b", "c"].map((name) => ({ name }));

  it("are those that are declared, and one more that closes an outline", () => {
    assert.deepEqual(linesOf({ handles, links: [["a", "b"]], closed: false }), [["a", "b"]]);
    assert.deepEqual(linesOf({ handles, links: [["a", "b"], ["b", "c"]], closed: true }), [["a", "b"], ["b", "c"], ["c", "a"]]);
  });

  it("close nothing that has no area", () => {
    assert.deepEqual(linesOf({ handles: handles.slice(0, 2), links: [], closed: true }), []);
    assert.deepEqual(linesOf({ handles: [], links: [], closed: true }), []);
  });
});
