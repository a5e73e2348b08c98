import assert from "node:assert/strict";
import { describe, it } from "node:test";

import { ofSession } from "../../frontend_static/follow/in_force.js";
import { pollWords, resultWords } from "../../frontend_static/lecturer/poll.js";

const poll = (more = {}) => ({ id: "p", question: "Q?", answers: ["Yes", "No"], votes: null, counts: null, revealed: false, ...more });

describe("what is said of a class", () => {
  it("tells the lecturer how many have answered, and nothing of what", () => {
    for (const [votes, words] of [[1, /^1 of 5 has answered\. /], [3, /^3 of 5 have answered\. /]]) {
      assert.match(pollWords(poll({ votes }), { followers: 5, asks: false }), words);
    }
  });

  it("tells a follower the own answer until all are told", () => {
    assert.match(pollWords(poll(), { own: null, asks: true }), /nobody sees who answered what/);
    assert.match(pollWords(poll(), { own: 1, asks: true }), /^You answered “No”/);
    assert.equal(pollWords(poll({ counts: [1, 2], revealed: true }), { own: 1, asks: true }), "Most answered “No”, 2 of 3; “Yes” 1.");
  });

  it("says of a poll who is ahead, and only so much", () => {
    for (const [counts, words] of [
      [[0, 0], "Nobody has answered."], [[2, 2, 1], "“A” and “B” were answered equally often, each 2 of 5; “C” 1."],
      [[1, 1, 1], "“A”, “B” and “C” were answered equally often, each 1 of 3."],
      [[1, 3, 2], "“B” was answered most often, 3 of 6; “C” 2, “A” 1."], [[1, 0], "Most answered “A”, 1 of 1; “B” 0."],
    ]) assert.equal(resultWords(["A", "B", "C"].slice(0, counts.length), counts), words);
  });
});

describe("the parameters that are in force", () => {
  const declared = (name, more = {}) => ({ name, title: name.toUpperCase(), unit: "px", kind: "number", trackers: [], ...more });
  const session = (more = {}) => ({
    declarations: [declared("a"), declared("b"), declared("c", { trackers: ["other"] }), declared("ink", { kind: "colour" })],
    controls: ["a", "b", "c", "ink"].map((name) => ({ name })),
    parameters: { a: 1, b: 2, c: 3, ink: "#ffffff" },
    timeline: [{ frame: 0, values: { a: 1 }, before: {} }],
    about: [],
    tracker: "mine",
    trackers: [{ id: "mine", title: "Mine" }, { id: "other", title: "Other" }],
    recipe: { seed: 7 },
    ...more,
  });

  it("are those that the tracker reads, with their units", () => {
    assert.deepEqual(ofSession(session()).map(({ title, value }) => `${title} ${value}`), ["Tracker Mine", "Seed 7", "A 1 px", "B 2 px"]);
  });

  it("come first where they were changed, with what they were before the first change", () => {
    const timeline = [
      { frame: 0, values: { a: 1 }, before: {} },
      { frame: 3, values: { b: 4 }, before: { b: 9 } },
      { frame: 5, values: { b: 2, tracker: "mine" }, before: { b: 4, tracker: "other" } },
    ];
    const found = ofSession(session({ timeline })).filter(({ isFirst }) => isFirst);
    assert.deepEqual(found.map(({ title, was }) => [title, was]), [["Tracker", "Other"], ["B", "9 px"]]);
  });

  it("were not changed where they are again what they were", () => {
    const timeline = [{ frame: 3, values: { b: 4 }, before: { b: 2 } }, { frame: 5, values: { b: 2 }, before: { b: 4 } }];
    assert.equal(ofSession(session({ timeline })).find(({ title }) => title === "B").was, undefined);
  });
});
