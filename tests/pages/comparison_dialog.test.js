import assert from "node:assert/strict";
import { describe, it } from "node:test";

import { sessionsBeside } from "../../frontend_static/shared/comparison.js";

const session = (id, experiment, footage, more) => ({ id, branch: "b0", name: `${id}.txt`, title: "", recipe: { experiment, footage, seed: 3 }, ...more });

describe("the other sessions of a run", () => {
  const own = session("a", "recorded", { start: 0 });
  const all = [session("d", "ball", null), session("c", "recorded", { start: 0 }), session("b", "recorded", { start: 0 }), session("e", "recorded", null), own];

  it("are those of the same experiment, on recordings as it is", () => {
    const found = sessionsBeside(own, all, true);
    assert.deepEqual(found.map(({ reference, title, isChosen }) => [reference, title, isChosen]), [["c:b0", "c.txt", true], ["b:b0", "b.txt", false]]);
  });

  it("are not chosen where there is something nearer", () => {
    assert.deepEqual(sessionsBeside(own, all, false).map(({ isChosen }) => isChosen), [false, false]);
  });
});
