import assert from "node:assert/strict";
import { describe, it } from "node:test";

import { beside, checked, figure } from "../../frontend_static/learn/numbers.js";
import { Progress } from "../../frontend_static/learn/progress.js";

const PLACE = "pftrack-lessons";

/** Give the page a store as a browser has it, which may be full. */
function storage(/** @type {Record<string, string>} */ held = {}, isFull = false) {
  const setItem = (/** @type {string} */ key, /** @type {string} */ value) => {
    if (isFull) throw new Error("full");
    held[key] = value;
  };
  const value = { getItem: (/** @type {string} */ key) => held[key] ?? null, setItem };
  Object.defineProperty(globalThis, "localStorage", { value, configurable: true });
  return held;
}

describe("progress", () => {
  it("comes back from the store as it was put there", () => {
    storage();
    const before = new Progress();
    before.set("sir", { given: 2, right: true });
    before.set("bayes", { given: "two", right: false });
    before.set("joint", { skipped: true });
    const after = new Progress();
    assert.deepEqual(after.of("sir"), { given: 2, right: true });
    assert.deepEqual(after.of("bayes"), { given: "two", right: false });
    assert.deepEqual(after.of("joint"), { skipped: true });
    assert.equal(after.of("kalman"), null);
    assert.equal(after.of("constructor"), null);
    assert.equal(after.done([{ id: "sir" }, { id: "bayes" }, { id: "joint" }, { id: "kalman" }]), 2);
    after.set("sir", null);
    assert.equal(new Progress().of("sir"), null);
  });

  it("takes up what it can read", () => {
    const lessons = { sir: { given: 2, right: true, stars: 5 }, kalman: { medal: "gold" }, joint: { given: null, right: true } };
    const held = storage({ [PLACE]: JSON.stringify({ version: 7, lessons }) });
    const progress = new Progress();
    assert.deepEqual(progress.of("sir"), { given: 2, right: true, stars: 5 });
    assert.equal(progress.of("kalman"), null);
    progress.set("bayes", { skipped: true });
    assert.deepEqual(Object.keys(JSON.parse(held[PLACE]).lessons).sort(), ["bayes", "sir"]);
  });

  for (const damaged of ["{", "5", "null", "[]", '"x"', "{}", '{"version": 1, "lessons": {"sir": 5}}']) {
    it(`begins anew where the store holds ${damaged}`, () => {
      storage({ [PLACE]: damaged });
      const progress = new Progress();
      assert.equal(progress.of("sir"), null);
      progress.set("sir", { given: 2, right: true });
      assert.deepEqual(new Progress().of("sir"), { given: 2, right: true });
    });
  }

  it("lasts as long as the page where the store is full, or forbidden", () => {
    const get = () => {
      throw new Error("forbidden");
    };
    for (const place of [() => storage({}, true), () => Object.defineProperty(globalThis, "localStorage", { get, configurable: true })]) {
      place();
      const progress = new Progress();
      progress.set("sir", { given: 2, right: true });
      progress.set("bayes", { skipped: true });
      assert.deepEqual(progress.of("sir"), { given: 2, right: true });
      assert.match(progress.remark, /is kept until you close this page/);
    }
  });

  it("adds to what another page has answered meanwhile", () => {
    const held = storage();
    const [one, other] = [new Progress(), new Progress()];
    one.set("sir", { given: 2, right: true });
    other.set("bayes", { skipped: true });
    assert.deepEqual(Object.keys(JSON.parse(held[PLACE]).lessons).sort(), ["bayes", "sir"]);
  });
});

describe("words", () => {
  it("round to what counts", () => {
    assert.equal(figure(0.28251, 4), "0.2825");
    assert.equal(figure(1234.6, 3), "1235");
    assert.equal(figure(0.1, 4, "m"), "0.1 m");
    assert.equal(figure(null, 4), "–");
  });

  it("tell whether a number is as close as it should be, without a tick as well", () => {
    const number = { exact: 0.2861, tolerance: 0.0106, digits: 4, unit: "", within: true };
    assert.equal(beside(number), "exact 0.2861, within 0.011");
    assert.equal(beside({ ...number, within: false }), "exact 0.2861, more than 0.011 off");
    assert.equal(beside({ ...number, tolerance: null, within: null }), "exact 0.2861");
    assert.equal(beside({ ...number, exact: null, within: null }), "");
  });

  it("tell a check by its value, its target and its tolerance", () => {
    const check = { check: "counting", title: "", ours: 0.2825, exact: 0.28613, tolerance: 0.0106, passed: true, problem: null };
    assert.equal(checked(check), "checked: 0.2825, exact 0.2861, within 0.0106");
    assert.equal(checked({ ...check, ours: 0.5, passed: false }), "fails: 0.5, exact 0.2861, not within 0.0106");
    assert.equal(checked({ ...check, problem: "It was killed." }), "It was killed.");
  });
});
