import assert from "node:assert/strict";
import { describe, it } from "node:test";

import { beside } from "../../frontend_static/learn/numbers.js";
import { Progress } from "../../frontend_static/learn/progress.js";

const PLACE = "pftrack-lessons";
const RIGHT = { given: 2, right: true };

/** Give the page a store as a browser has it, which may be full. */
function storage(held = {}, isFull = false) {
  const setItem = (key, value) => {
    if (isFull) throw new Error("full");
    held[key] = value;
  };
  Object.defineProperty(globalThis, "localStorage", { value: { getItem: (key) => held[key] ?? null, setItem }, configurable: true });
  return held;
}

describe("progress", () => {
  it("comes back from the store as it was put there", () => {
    storage();
    const [before, answers] = [new Progress(), { sir: RIGHT, bayes: { given: "two", right: false }, joint: { skipped: true } }];
    for (const [lesson, answer] of Object.entries(answers)) before.set(lesson, answer);
    const after = new Progress();
    for (const [lesson, answer] of Object.entries({ ...answers, kalman: null })) assert.deepEqual(after.of(lesson), answer);
    assert.equal(after.of("constructor"), null);
    assert.equal(after.done([{ id: "sir" }, { id: "bayes" }, { id: "joint" }, { id: "kalman" }]), 2);
    after.set("sir", null);
    assert.equal(new Progress().of("sir"), null);
  });

  it("takes up what it can read", () => {
    const lessons = { sir: { ...RIGHT, stars: 5 }, kalman: { medal: "gold" }, joint: { given: null, right: true } };
    const held = storage({ [PLACE]: JSON.stringify({ version: 7, lessons }) });
    const progress = new Progress();
    assert.deepEqual(["sir", "kalman"].map((lesson) => progress.of(lesson)), [{ ...RIGHT, stars: 5 }, null]);
    progress.set("bayes", { skipped: true });
    assert.deepEqual(Object.keys(JSON.parse(held[PLACE]).lessons).sort(), ["bayes", "sir"]);
  });

  for (const damaged of ["{", "5", "null", "[]", '"x"', "{}", '{"version": 1, "lessons": {"sir": 5}}']) {
    it(`begins anew where the store holds ${damaged}`, () => {
      storage({ [PLACE]: damaged });
      const progress = new Progress();
      assert.equal(progress.of("sir"), null);
      progress.set("sir", RIGHT);
      assert.deepEqual(new Progress().of("sir"), RIGHT);
    });
  }

  it("lasts as long as the page where the store is full, or forbidden", () => {
    const get = () => {
      throw new Error("forbidden");
    };
    for (const place of [() => storage({}, true), () => Object.defineProperty(globalThis, "localStorage", { get, configurable: true })]) {
      place();
      const progress = new Progress();
      progress.set("sir", RIGHT);
      progress.set("bayes", { skipped: true });
      assert.deepEqual(progress.of("sir"), RIGHT);
      assert.match(progress.remark, /is kept until you close this page/);
    }
  });

  it("adds to what another page has answered meanwhile", () => {
    const [held, one, other] = [storage(), new Progress(), new Progress()];
    one.set("sir", RIGHT);
    other.set("bayes", { skipped: true });
    assert.deepEqual(Object.keys(JSON.parse(held[PLACE]).lessons).sort(), ["bayes", "sir"]);
  });
});

it("words say whether a number is close enough, also without a tick", () => {
  const number = { exact: 0.2861, tolerance: 0.0106, digits: 4, unit: "", within: true };
  for (const [more, words] of [
    [{}, "exact 0.2861, within 0.011"], [{ within: false }, "exact 0.2861, more than 0.011 off"],
    [{ tolerance: null, within: null }, "exact 0.2861"], [{ exact: null, within: null }, ""],
  ]) assert.equal(beside({ ...number, ...more }), words);
});
