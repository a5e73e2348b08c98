import assert from "node:assert/strict";
import { describe, it } from "node:test";

import { axisOf, rowOf } from "../../frontend_static/sweep/plan.js";
import { queryOf, viewOf, wishOf } from "../../frontend_static/sweep/store.js";

describe("the values of an axis", () => {
  const declaration = { name: "n", kind: "number", default: 40, step: 5, useful: [0, 100], choices: [] };
  const range = ({ start, stop, step }) => [start, stop, step];

  it("are given, taken from a list, or over the useful range in whole steps of the slider", () => {
    const rows = [rowOf(declaration, { start: 1, stop: 9, step: 2 }), rowOf(declaration, { values: [0.1, 0.2, 0.3] }), rowOf(declaration)];
    rows.push(rowOf({ ...declaration, useful: [0, 8] }));
    assert.deepEqual(rows.map(range), [["1", "9", "2"], ["0.1", "0.3", "0.1"], ["0", "100", "10"], ["0", "8", "5"]]);
  });

  it("are sent as they are typed: an empty field is null, and no number stays a word", () => {
    assert.deepEqual(axisOf({ ...rowOf(declaration), stop: " " }), { name: "n", start: 0, stop: null, step: 10 });
    assert.deepEqual(axisOf({ declaration, form: "list", list: "1, 2;x 3" }).values, [1, 2, "x", 3]);
    for (const [kind, choices, first, values] of [["choice", ["two words", "one"], "one", ["two words", "one"]], ["boolean", [], true, [false, true]]]) {
      assert.deepEqual(axisOf(rowOf({ name: "n", kind, choices, default: first })).values, values);
    }
  });
});

describe("what of a sweep is shown", () => {
  const trackers = ["p", "q", "r"].map((id) => ({ id, title: id }));
  const sweep = { judged: true, has_truth: true, measures: [], unit: "px", trackers };
  const cells = { x: { name: "a" }, y: null, maps: [] };
  const shown = (query) => viewOf(wishOf(new URLSearchParams(query)), sweep, cells).view;

  it("comes back from the address that names it", () => {
    for (const query of ["show=significance&of=error&x=a&y=none&first=p&second=q&level=0.001&correction=holm", ""]) {
      assert.equal(queryOf(wishOf(new URLSearchParams(query))).toString(), query);
      if (query) assert.equal(queryOf(shown(query)).toString(), query);
    }
  });

  it("is what the sweep has where an address names what it has not", () => {
    const { show, of, first, second, x, y } = shown("show=colours&of=beauty&first=z&second=p");
    assert.deepEqual([show, of, first, second, x, y], ["values", "success", "q", "p", "a", "none"]);
    assert.equal(viewOf(wishOf(new URLSearchParams("show=difference")), { ...sweep, trackers: [trackers[0]] }, cells).compares, false);
  });
});
