import assert from "node:assert/strict";
import { describe, it } from "node:test";

import { decode, encode, linkTo } from "../../frontend_static/shared/share_link.js";

describe("a link that holds a run", () => {
  const recipe = { experiment: "ball", seed: 2 ** 53 - 1, timeline: [{ frame: 3, values: { width: 0.1, name: "größer ▲ 人" } }] };

  it("gives back what was put in, however long it is, in letters that an address may have", () => {
    const timeline = Array.from({ length: 10_000 }, (_, frame) => ({ frame, values: { occlusion_width_px: frame / 7 } }));
    const padded = Array.from({ length: 8 }, (_, length) => ({ experiment: "x".repeat(length) }));
    for (const each of [recipe, { ...recipe, timeline }, ...padded]) {
      const text = encode(each);
      assert.match(text, /^[A-Za-z0-9_-]+$/);
      assert.deepEqual([decode(`#${text}`), decode(text), linkTo(each)], [each, each, `session/new#${text}`]);
    }
  });

  it("refuses what holds no run", () => {
    const wrong = ["", "#", "#%%%", ...[[1], null, { seed: 1 }].map((each) => `#${encode(each)}`)];
    for (const each of wrong) assert.throws(() => decode(each), undefined, each);
  });
});
