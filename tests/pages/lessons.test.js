import assert from "node:assert/strict";
import { describe, it } from "node:test";

import { ApiError } from "../../frontend_static/shared/api.js";
import { NewestRequest } from "../../frontend_static/learn/newest_request.js";
import { Progress, VERSION, read } from "../../frontend_static/learn/progress.js";
import { beside, checked, figure, standing, parseNumber } from "../../frontend_static/learn/number_text.js";

const PLACE = "pftrack-lessons";

/** A store as a browser has it, which may be full. */
function storage(/** @type {Record<string, string>} */ held = {}, isFull = false) {
  return {
    held,
    getItem: (/** @type {string} */ key) => held[key] ?? null,
    setItem: (/** @type {string} */ key, /** @type {string} */ value) => {
      if (isFull) throw new Error("full");
      held[key] = value;
    },
  };
}

describe("progress", () => {
  it("comes back from the store as it was put there", () => {
    const store = storage();
    const before = new Progress(() => store);
    before.set("sir", { given: 2, right: true });
    before.set("bayes", { given: "two", right: false });
    before.set("joint", { skipped: true });
    const after = new Progress(() => store);
    assert.deepEqual(after.of("sir"), { given: 2, right: true });
    assert.deepEqual(after.of("bayes"), { given: "two", right: false });
    assert.deepEqual(after.of("joint"), { skipped: true });
    assert.equal(after.of("kalman"), null);
    assert.equal(after.of("constructor"), null);
    assert.equal(after.done([{ id: "sir" }, { id: "bayes" }, { id: "joint" }, { id: "kalman" }]), 2);
    assert.equal(after.remark, "");
    after.set("sir", null);
    assert.equal(new Progress(() => store).of("sir"), null);
  });

  it("takes up what it can read of another version, says so, and leaves the rest aside as it was", () => {
    const text = JSON.stringify({
      version: 7,
      theme: "owls",
      lessons: { sir: { given: 2, right: true, stars: 5 }, kalman: { medal: "gold" }, joint: { given: null, right: true } },
    });
    const store = storage({ [PLACE]: text });
    const progress = new Progress(() => store);
    assert.deepEqual(progress.of("sir"), { given: 2, right: true });
    assert.equal(progress.of("kalman"), null);
    assert.equal(
      progress.remark,
      "Your progress was kept by another version of pftrack: 1 of its 3 lessons can be read, the others are asked again. " +
        "What was kept is still in this browser, in its store under “pftrack-lessons-unread”.",
    );
    progress.set("bayes", { skipped: true });
    assert.match(progress.remark, /another version/);
    const kept = JSON.parse(store.held[PLACE]);
    assert.deepEqual([kept.version, kept.theme, Object.keys(kept.lessons).sort()], [VERSION, "owls", ["bayes", "sir"]]);
    assert.equal(store.held["pftrack-lessons-unread"], text);
    assert.equal(new Progress(() => store).remark, "");
  });

  it("says nothing of another version that held nothing, and that all is there where it is", () => {
    assert.equal(read('{"version": 7, "lessons": {}}').remark, "");
    assert.match(read('{"version": 7, "lessons": {"sir": {"skipped": true}}}').remark, /all of it can be read/);
  });

  for (const damaged of ["{", "5", "null", "[]", '"x"', "{}", '{"version": 1, "lessons": 5}', '{"version": 1, "lessons": {"sir": 5}}']) {
    it(`begins anew where the store holds ${damaged}, and says so`, () => {
      const store = storage({ [PLACE]: damaged });
      const progress = new Progress(() => store);
      assert.equal(progress.of("sir"), null);
      assert.match(progress.remark, /None of it can be read here, so that every lesson is asked again/);
      assert.equal(store.held["pftrack-lessons-unread"], damaged);
      progress.set("sir", { given: 2, right: true });
      assert.deepEqual(read(store.held[PLACE]).entries, { sir: { given: 2, right: true } });
    });
  }

  it("lasts as long as the page where the store is full, or forbidden", () => {
    const forbidden = () => {
      throw new Error("forbidden");
    };
    for (const place of [() => storage({}, true), forbidden]) {
      const progress = new Progress(place);
      progress.set("sir", { given: 2, right: true });
      progress.set("bayes", { skipped: true });
      assert.deepEqual(progress.of("sir"), { given: 2, right: true });
      assert.match(progress.remark, /lasts until you close this page/);
    }
  });

  it("adds to what another page has answered meanwhile", () => {
    const store = storage();
    const [one, other] = [new Progress(() => store), new Progress(() => store)];
    one.set("sir", { given: 2, right: true });
    other.set("bayes", { skipped: true });
    assert.deepEqual(Object.keys(JSON.parse(store.held[PLACE]).lessons).sort(), ["bayes", "sir"]);
  });
});

describe("what a slider asks for", () => {
  /** Who answers when it is told to, and remembers what was asked. */
  function server() {
    /** @type {{wish: number, answer: (value: unknown) => void, fail: (error: Error) => void}[]} */
    const asked = [];
    const send = (/** @type {number} */ wish) => new Promise((answer, fail) => asked.push({ wish, answer, fail }));
    return { asked, send };
  }

  const turn = () => new Promise((resolve) => setImmediate(resolve));

  it("is one request at a time, and then the newest only", async () => {
    const { asked, send } = server();
    /** @type {[unknown, number, boolean][]} */
    const told = [];
    const newest = new NewestRequest(send, {
      answer: (answer, wish, isNewest) => told.push([answer, wish, isNewest]),
      refused: assert.fail,
      lost: assert.fail,
    }, new AbortController().signal);
    for (let value = 0; value < 100; value += 1) newest.ask(value);
    assert.deepEqual(asked.map(({ wish }) => wish), [0]);
    asked[0].answer("first");
    await turn();
    assert.deepEqual(asked.map(({ wish }) => wish), [0, 99]);
    asked[1].answer("last");
    await turn();
    assert.deepEqual(told, [["first", 0, false], ["last", 99, true]]);
    newest.ask(5);
    assert.equal(asked.length, 3);
  });

  it("is tried again while the server is gone, with the newest value, and told once", async () => {
    const { asked, send } = server();
    /** @type {boolean[]} */
    const lost = [];
    const pauses = /** @type {(() => void)[]} */ ([]);
    const pause = () => new Promise((resolve) => pauses.push(() => resolve(undefined)));
    const newest = new NewestRequest(send, { answer: () => {}, refused: assert.fail, lost: (is) => lost.push(is) }, new AbortController().signal, pause);
    const gone = new ApiError(0, { message: "The server does not answer" });
    newest.ask(1);
    asked[0].fail(gone);
    await turn();
    newest.ask(2);
    pauses[0]();
    await turn();
    asked[1].fail(gone);
    await turn();
    pauses[1]();
    await turn();
    assert.deepEqual([asked.map(({ wish }) => wish), lost], [[1, 2, 2], [true]]);
    asked[2].answer("back");
    await turn();
    assert.deepEqual(lost, [true, false]);
  });

  it("is told when it is refused, and goes on", async () => {
    const { asked, send } = server();
    /** @type {number[]} */
    const refused = [];
    const newest = new NewestRequest(send, { answer: () => {}, refused: (_, wish) => refused.push(wish), lost: assert.fail }, new AbortController().signal);
    newest.ask(1);
    newest.ask(2);
    asked[0].fail(new ApiError(422, { message: "N must be at most 5, got 9" }));
    await turn();
    assert.deepEqual([refused, asked.map(({ wish }) => wish)], [[1], [1, 2]]);
  });

  it("is neither sent nor told once the page is gone", async () => {
    const { asked, send } = server();
    const end = new AbortController();
    const newest = new NewestRequest(send, { answer: assert.fail, refused: assert.fail, lost: assert.fail }, end.signal);
    newest.ask(1);
    newest.ask(2);
    end.abort();
    asked[0].answer("too late");
    await turn();
    assert.equal(asked.length, 1);
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
    assert.equal(beside({ ...number, within: false }), "exact 0.2861, further off than 0.011");
    assert.equal(beside({ ...number, tolerance: null, within: null }), "exact 0.2861");
    assert.equal(beside({ ...number, exact: null, within: null }), "");
  });

  it("tell a check by its value, its target and its tolerance", () => {
    const check = { check: "counting", title: "", ours: 0.2825, exact: 0.28613, tolerance: 0.0106, passed: true, problem: null };
    assert.equal(checked(check), "checked: 0.2825, exact 0.2861, within 0.0106");
    assert.equal(checked({ ...check, ours: 0.5, passed: false }), "fails: 0.5, exact 0.2861, not within 0.0106");
    assert.equal(checked({ ...check, problem: "It was killed." }), "It was killed.");
  });

  it("tell how a lesson stands", () => {
    assert.equal(standing(null), "not answered yet");
    assert.equal(standing({ skipped: true }), "looked at without an answer");
    assert.equal(standing({ given: 2, right: true }), "answered rightly");
    assert.equal(standing({ given: 4, right: false }), "answered, and off");
  });

  it("read a number with a point or a comma, and leave anything else to the server", () => {
    assert.equal(parseNumber(" 0.5 "), 0.5);
    assert.equal(parseNumber("0,5"), 0.5);
    assert.equal(parseNumber("-1e3"), -1000);
    assert.equal(parseNumber("1,000,000"), "1,000,000");
    assert.equal(parseNumber("half"), "half");
    assert.equal(parseNumber("Infinity"), "Infinity");
    assert.equal(parseNumber(""), "");
  });
});
