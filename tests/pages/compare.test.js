import assert from "node:assert/strict";
import { describe, it } from "node:test";

import { JointStore } from "../../frontend_static/compare/joint_store.js";
import { outcomeLines } from "../../frontend_static/compare/table.js";
import { keepUp } from "../../frontend_static/session/clock.js";
import { coated } from "../../frontend_static/session/flat/drawing.js";
import { Store } from "../../frontend_static/session/store.js";
import { linkTo, linkToReferences, wantedOf } from "../../frontend_static/shared/comparison.js";
import { effect } from "../../frontend_static/vendor/preact.js";

/** A session of so many frames, of which some are computed. */
function session({ frames = 50, computed = 10, position = 0, ...more } = {}) {
  const store = new Store();
  const numbers = Array.from({ length: computed + 1 }, (_, frame) => frame);
  store.receive({
    type: "hello",
    diagnostics: { frame: numbers, error: numbers, estimate: numbers.map((number) => [number]) },
    session: {
      id: "s", state: "ready", branch: "b0", branches: [{ id: "b0", parent: null, frame: 0 }], position, computed, frames, goal: null,
      playing: false, speed: 1, speeds: [1], timeline: [], thresholds: [], tracker: "a", ...more,
    },
  });
  return store;
}

const run = (store, name, first = 0) => ({ store, name, colour: "#000000", first });

describe("several runs as one store", () => {
  it("has them as branches, the one in front first", () => {
    const joint = new JointStore([run(session(), "one"), run(session(), "two")], 0, false);
    assert.deepEqual(joint.branches.map(({ title }) => title), ["one", "two"]);
    joint.front.value = 1;
    assert.deepEqual(joint.branches.map(({ title }) => title), ["two", "one"]);
  });

  it("moves without having drawn anew what stays", () => {
    const lead = session();
    const joint = new JointStore([run(lead, "one"), run(session(), "two")], 0, false);
    const drawn = [];
    effect(() => void drawn.push([joint.known.branches, joint.known.bookmarks, joint.known.timeline, joint.known.thresholds]));
    lead.receive({ type: "changes", session: { position: 4 }, rows: [] });
    assert.equal(joint.known.position, 4);
    assert.equal(drawn.length, 1);
  });

  it("counts frames as the leading run does", () => {
    const timeline = [{ frame: 8, values: {} }];
    const late = session({ frames: 40, computed: 5 });
    const joint = new JointStore([run(session({ frames: 43, computed: 12, timeline }), "early", 3), run(late, "late")], 1, false);
    assert.equal(joint.known.frames, 40);
    assert.equal(joint.known.computed, 5);
    assert.equal(joint.historyOf("0").at(0).frame, 3);
    assert.equal(joint.historyOf("0").length, 10);
    assert.equal(joint.historyOf("0").at(9).error, 12);
    assert.equal(joint.historyOf("0").at(10), undefined);
    assert.deepEqual(joint.known.timeline, [{ frame: 5, values: {} }]);
    late.receive({ type: "changes", session: { position: 4 }, rows: [] });
    assert.equal(joint.known.position, 4);
  });

  it("knows nothing before all of them are there, and marks what is known of the whole", () => {
    const late = new Store();
    const joint = new JointStore([run(session(), "one"), run(late, "two")], 0, false);
    assert.equal(joint.session, null);
    late.receive({ type: "hello", diagnostics: { frame: [0] }, session: session().known });
    assert.equal(joint.known.branches.length, 2);
    assert.equal(joint.knowsLoss, false);
    joint.whole.value = { beforeLoss: 7, notes: [{ frame: 9, note: "they part" }] };
    assert.deepEqual([joint.knowsLoss, joint.beforeLoss], [true, 7]);
    assert.deepEqual(joint.known.bookmarks.map(({ frame, note }) => [frame, note]), [[9, "they part"]]);
  });
});

describe("events", () => {
  const flagged = (name, frames, first = 0) => {
    const store = session({ computed: 9, series: [{ name, role: "event", title: name, colours: [] }] });
    for (const frame of frames) store.history.at(frame).series = { [name]: 1 };
    return run(store, name, first);
  };

  it("are found once where they last, in the frames of all runs", () => {
    const joint = new JointStore([flagged("switch", [2, 6]), flagged("gone", [5, 6, 7], 1)], 0, false);
    assert.deepEqual(joint.eventFrames, [2, 4, 6]);
  });
});

describe("runs that begin at different pictures", () => {
  it("are kept at the same picture", () => {
    const sought = [];
    const steering = { seek: (frame) => sought.push(frame), setSpeed: () => {}, pause: () => {} };
    const { signal } = new AbortController();
    const [lead, other] = [session({ frame_rate_hz: 30 }), session({ position: 3, frame_rate_hz: 30 })];
    keepUp({ store: other, steering, first: 3 }, lead, signal);
    lead.receive({ type: "changes", session: { position: 5 }, rows: [] });
    assert.deepEqual(sought, [8]);
    lead.receive({ type: "changes", session: { position: 40, playing: true }, rows: [] });
    assert.deepEqual(sought, [8, 43], "also where they play");
  });
});

describe("the address of a comparison", () => {
  const runs = [{ recipe: { experiment: "ball", seed: 7 } }, { recipe: { experiment: "ball", tracker: "größe" } }];
  const address = (link) => new URL(link, "http://here/");

  it("holds what makes the runs", () => {
    assert.deepEqual(wantedOf(address(linkTo({ runs, position: 5, arrangement: "over" }))), { runs, position: 5, arrangement: "over" });
    assert.deepEqual(wantedOf(address(linkTo({ runs }))), { runs, position: 0, arrangement: "side" });
  });

  it("names runs of this server by references", () => {
    const wanted = wantedOf(address(linkToReferences(["ab", "cd:b1", "ef:3:apf"], 12)));
    assert.deepEqual(wanted, { runs: ["ab", "cd:b1", "ef:3:apf"].map((reference) => ({ reference })), position: 12 });
  });

  it("says when it is damaged, and when it names nothing", () => {
    assert.equal(wantedOf(address("/compare")), null);
    const whole = linkTo({ runs });
    for (const link of [whole.slice(0, -9), `${whole}!`, "/compare#e30", "/compare#bnVsbA"]) assert.throws(() => wantedOf(address(link)), /damaged/);
  });
});

describe("what came of the runs, in words", () => {
  const paired = { first: 0, second: 1, name: "error", title: "Error", unit: "px", better: "lower", frames: 240, mean: 17.14, low: 9.97, high: 24.3 };
  const outcomes = [{ mean_error: 3.4, success_share: 1, first_lost_frame: null, lost_frames: 0 }, { mean_error: null, success_share: 0.404, first_lost_frame: 8, lost_frames: 143 }];
  const known = { unit: "px", names: ["A", "B"], measure: "Not lost" };

  it("is a line for each quantity that is known", () => {
    const lines = outcomeLines({ frames: 240, outcomes, paired: [paired] }, known);
    assert.deepEqual(lines.map(({ title, cells }) => [title, ...cells.map(({ text }) => text)]), [
      ["Mean error", "3.4 px", "–"],
      ["Not lost", "100 %", "40 %"],
      ["First lost frame", "never", "8"],
      ["Error, difference", "", "+17.1 px"],
    ]);
    assert.equal(lines[3].cells[1].more, "10.0 to 24.3");
    const unknown = outcomes.map(() => ({ mean_error: null, success_share: null, first_lost_frame: null, lost_frames: null }));
    assert.deepEqual(outcomeLines({ frames: 240, outcomes: unknown, paired: [{ ...paired, mean: null, low: null, high: null }] }, known), []);
  });
});

describe("flat views over each other", () => {
  const [tint, black] = [[0, 158, 115], [0, 0, 0]];

  it("leave picture and truth to the lowest, and have a colour each", () => {
    const upper = { tint, isLowest: false };
    const lowest = { tint, isLowest: true };
    const picture = { kind: "picture", name: "picture", layer: "picture" };
    const truth = { kind: "ellipse", name: "truth", layer: "truth", colour: black };
    assert.deepEqual([coated(picture, upper), coated(truth, upper)], [null, null]);
    assert.deepEqual([coated(picture, lowest), coated(truth, lowest)], [picture, truth]);
    assert.deepEqual(coated({ kind: "polyline", colour: [0, 114, 178] }, upper), { kind: "polyline", colour: tint });
    const points = coated({ kind: "points", colours: new Uint8Array(6) }, lowest);
    assert.deepEqual([...points.colours], [...tint, ...tint]);
  });
});
