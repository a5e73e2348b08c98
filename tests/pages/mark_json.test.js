import assert from "node:assert/strict";
import { describe, it } from "node:test";

import { linesOf, markOf, valueAt } from "../../frontend_static/shared/marks/mark_json.js";

describe("the parts of a mark", () => {
  it("stand where their paths say, lists included", () => {
    const parts = [["ends.0", [1, 2]], ["ends.1", [3, 4]], ["style.width", 5], ["name", "x"]];
    const mark = markOf("line", parts);
    assert.deepEqual(mark, { kind: "line", ends: [[1, 2], [3, 4]], style: { width: 5 }, name: "x" });
    for (const [path, value] of parts) assert.deepEqual(valueAt(mark, path), value);
  });

  it("are missing where there is nothing", () => {
    for (const [mark, path] of [[null, "a.b"], [{ a: 1 }, "b.c"], [{ points: {} }, "points.nose"]]) assert.equal(valueAt(mark, path), undefined);
  });
});

describe("the lines of a mark", () => {
  const handles = ["a", "b", "c"].map((name) => ({ name }));

  for (const [what, count, closed, links, more] of [
    ["those that are declared", 3, false, [["a", "b"]], []],
    ["one more that closes an outline", 3, true, [["a", "b"], ["b", "c"]], [["c", "a"]]],
    ["none that would close what has no area", 2, true, [], []],
    ["none without points", 0, true, [], []],
  ]) {
    it(`are ${what}`, () => assert.deepEqual(linesOf({ handles: handles.slice(0, count), links, closed }), [...links, ...more]));
  }
});
