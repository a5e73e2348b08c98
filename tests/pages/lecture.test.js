import assert from "node:assert/strict";
import { describe, it } from "node:test";

import { itemOfAddress } from "../../frontend_static/lecturer/items.js";
import { begin, clock, clockWords, endWalk, go, hostOf, minutesText, pageOf, spentOn, time } from "../../frontend_static/lecturer/walk.js";
import { moved } from "../../frontend_static/lectures/order.js";
import { answers } from "../../frontend_static/shared/api.js";
import { linkTo as comparisonLink } from "../../frontend_static/shared/comparison.js";
import { linkTo } from "../../frontend_static/shared/share_link.js";

const MINUTE = 60_000;
const item = (title, page, more = {}) => ({ item: {}, kind: page ? "lesson" : "poll", title, minutes: 5, page, asks: page ? null : { question: title, answers: ["a", "b"] }, problem: null, ...more });
const lecture = (...items) => ({ id: "x", title: "X", items });
const walk = (...items) => begin(lecture(...items), 0);

describe("the walk through a lecture", () => {
  it("leaves out what is not here, and does not begin where nothing can be shown", () => {
    const found = walk(item("gone", null, { asks: null, problem: "Line 4: it is not here" }), item("one", "learn/one"));
    assert.deepEqual(found.steps.map(({ title }) => title), ["one"]);
    assert.deepEqual([walk(item("poll", null)), walk()], [null, null]);
  });

  it("asks a poll over what is shown before it, or else after it", () => {
    let found = walk(item("first", null), item("one", "learn/one"), item("second", null), item("third", null), item("two", "learn/two"));
    assert.deepEqual([0, 1, 2, 3, 4].map((at) => hostOf(found, at)), [1, 1, 1, 1, 4]);
    found = go(found, 3, 0);
    assert.equal(pageOf(found), "learn/one");
  });

  it("takes the time of each step, also of one that is come back to", () => {
    let found = go(walk(item("one", "learn/one"), item("two", "learn/two")), 1, 3 * MINUTE);
    found = go(found, -1, 4 * MINUTE);
    const minutes = (taken, planned) => ({ taken: taken * MINUTE, planned: planned * MINUTE });
    assert.deepEqual(clock(found, 10 * MINUTE), { whole: minutes(10, 10), step: minutes(9, 5) });
    assert.equal(spentOn(found, 1, 10 * MINUTE), MINUTE);
    found = endWalk(found, 11 * MINUTE);
    assert.deepEqual([spentOn(found, 0, 99 * MINUTE), clock(found, 99 * MINUTE).whole.taken], [10 * MINUTE, 11 * MINUTE]);
  });

  it("is told in words", () => {
    assert.deepEqual([0, 65_000, 3_845_000].map(time), ["0:00", "1:05", "1:04:05"]);
    const words = [65_000, 6.5 * MINUTE].map((taken) => clockWords({ taken, planned: 5 * MINUTE }));
    assert.deepEqual(words, ["1:05 of 5 min", "6:30 of 5 min, 1:30 over"]);
    assert.deepEqual([2.5, 60, 75, 119.98].map(minutesText), ["2.5 min", "1 h", "1 h 15 min", "2 h"]);
  });
});

it("the order of a lecture gives one entry another place", () => {
  assert.deepEqual([[0, 2], [2, 0]].map(([from, to]) => moved([..."abc"], from, to).join("")), ["bca", "cab"]);
});

describe("a link that becomes an item", () => {
  const of = (text) => itemOfAddress(text, "https://host/any/prefix/");

  it("is that of a lesson, a failure, or a session that runs", async () => {
    assert.deepEqual(await of("https://host/any/prefix/learn/bayes#use-1"), { lesson: "bayes" });
    assert.deepEqual(await of(" failures/look%20alike "), { failure: "look alike" });
    answers["GET sessions/{session}"] = async ({ session }) => ({ recipe: session, upload: null, position: 4, name: "Mine" });
    assert.deepEqual(await of("session/0f"), { session: { recipe: "0f", upload: null, position: 4 }, title: "Mine" });
  });

  it("is that of a run or a comparison, with all that makes it", async () => {
    const recipe = { experiment: "ball", seed: 3 };
    assert.deepEqual(await of(linkTo({ recipe, position: 7, play: true })), { session: { recipe, position: 7 } });
    const wanted = { runs: [{ recipe }, { recipe: { ...recipe, seed: 4 } }], position: 2, arrangement: "over" };
    assert.deepEqual(await of(comparisonLink(wanted)), { comparison: wanted });
    assert.deepEqual((await of("compare?runs=a,b")).comparison.runs, [{ reference: "a" }, { reference: "b" }]);
    answers["GET comparisons/saved/{saved}"] = async ({ saved }) => ({ ...wanted, title: saved, id: saved });
    assert.deepEqual(await of("compare?saved=7"), { comparison: wanted, title: "7" });
  });

  it("is refused where it is none", async () => {
    for (const text of ["", "https://host/any/prefix/work", "learn/", "session/new", "http://[", "compare"]) await assert.rejects(of(text), /not a link|cannot show/);
    for (const text of ["session/new#%%%", "learn/%"]) await assert.rejects(of(text), /damaged/);
  });
});
