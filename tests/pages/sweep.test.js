import assert from "node:assert/strict";
import { describe, it } from "node:test";

import { listOf, rangeOf } from "../../frontend_static/sweep/axis_inputs.js";
import { queryOf, viewOf } from "../../frontend_static/sweep/view.js";

describe("the values of an axis", () => {
  const declaration = { default: 40, step: 5, minimum: 0, maximum: 50, useful: [0, 50] };

  it("are given, taken from a list, or made up within the bounds", () => {
    assert.deepEqual(rangeOf(declaration, { start: 1, stop: 9, step: 2 }), { start: 1, stop: 9, step: 2 });
    assert.deepEqual(rangeOf(declaration, { values: [10, 20, 30] }), { start: 10, stop: 30, step: 10 });
    assert.deepEqual(rangeOf(declaration, {}), { start: 20, stop: 50, step: 10 });
    assert.deepEqual(rangeOf({ ...declaration, step: null, maximum: null }, {}), { start: 20, stop: 60, step: 10 });
  });

  it("of a range become a list without the traces of floating point, unless it is long or no range", () => {
    assert.deepEqual(listOf({ start: 0.1, stop: 0.4, step: 0.1 }), [0.1, 0.2, 0.3, 0.4]);
    assert.deepEqual(listOf({ start: 5, stop: 5, step: 1 }), [5]);
    for (const none of [{ start: 0, stop: 1000, step: 1 }, { start: 0, stop: 1, step: 0 }, { start: null, stop: 1, step: 1 }, { start: 2, stop: 1, step: 1 }]) {
      assert.equal(listOf(none), null);
    }
  });
});

describe("what of a sweep is shown", () => {
  it("comes back from the address that names it", () => {
    const view = { show: "significance", of: "inside_share", measure: "error", x: "a", y: "none", first: "p", second: "q", level: 0.001, correction: "holm", test: "fisher" };
    assert.deepEqual(viewOf(queryOf(view)), view);
    assert.equal(queryOf(viewOf(new URLSearchParams())).size, 0);
  });

  it("is the usual where an address says what there is not", () => {
    assert.equal(viewOf(new URLSearchParams("measure=inside_share")).measure, "inside_share");
    const view = viewOf(new URLSearchParams("show=colours&measure=&level=x&correction=all&test=rank-sum"));
    assert.deepEqual(view, viewOf(new URLSearchParams()));
  });
});
