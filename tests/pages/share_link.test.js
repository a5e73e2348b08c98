import assert from "node:assert/strict";
import { describe, it } from "node:test";

import { decode, encode, linkTo } from "../../frontend_static/shared/share_link.js";

describe("a link that holds a run", () => {
  const recipe = { experiment: "ball", seed: 2 ** 53 - 1, timeline: [{ frame: 3, values: { width: 0.1, name: "größer ▲ 人" } }] };

  it("gives back what was put in, in letters that an address may have", () => {
    assert.deepEqual(decode(`#${encode(recipe)}`), recipe);
    assert.deepEqual(decode(encode(recipe)), recipe);
    assert.match(encode(recipe), /^[A-Za-z0-9_-]+$/);
    assert.equal(linkTo(recipe), `session/new#${encode(recipe)}`);
  });

  it("round-trips whatever length its padding has", () => {
    for (let length = 0; length < 8; length += 1) {
      const one = { experiment: "x".repeat(length) };
      assert.deepEqual(decode(encode(one)), one);
    }
  });

  it("holds a run whose parameters were changed thousands of times", () => {
    const timeline = Array.from({ length: 10_000 }, (_, frame) => ({ frame, values: { occlusion_width_px: frame / 7 } }));
    const long = { ...recipe, timeline };
    assert.deepEqual(decode(encode(long)), long);
  });

  it("refuses what holds no run", () => {
    for (const wrong of ["", "#", "#%%%", `#${encode([1])}`, `#${encode(null)}`, `#${encode({ seed: 1 })}`]) {
      assert.throws(() => decode(wrong), undefined, wrong);
    }
  });
});
