import assert from "node:assert/strict";
import { describe, it } from "node:test";

import { JointStore } from "../../frontend_static/compare/joint_store.js";
import { outcomeLines } from "../../frontend_static/compare/table.js";
import { coated } from "../../frontend_static/session/flat/drawing.js";
import { Store } from "../../frontend_static/session/store.js";
import { linkTo, linkToReferences, wantedOf } from "../../frontend_static/shared/comparison.js";
import { changes, hello } from "./making.js";

/** A session of 50 frames, some of them computed; each error is its frame number. */
function session({ computed = 10, ...more } = {}) {
  const [store, frame] = [new Store(), Array.from({ length: computed + 1 }, (_, number) => number)];
  store.receive(hello({ computed, ...more }, { frame, error: frame, estimate: frame.map((number) => [number]) }));
  return store;
}

const run = (store, name, first = 0) => ({ store, name, colour: "#000000", first });

describe("several runs as one store", () => {
  it("counts frames as the leading run does", () => {
    const timeline = [{ frame: 8, values: {} }];
    const late = session({ frames: 40, computed: 5 });
    const joint = new JointStore([run(session({ frames: 43, computed: 12, timeline }), "early", 3), run(late, "late")], 1, false);
    assert.deepEqual([joint.known.frames, joint.known.computed, joint.known.timeline], [40, 5, [{ frame: 5, values: {} }]]);
    const early = joint.historyOf("0");
    assert.deepEqual([early.at(0).frame, early.length, early.at(9).error, early.at(10)], [3, 10, 12, undefined]);
    late.receive(changes({ position: 4 }));
    assert.equal(joint.known.position, 4);
  });

  it("knows nothing before all of them are there, and marks what is known of the whole", () => {
    const late = new Store();
    const joint = new JointStore([run(session(), "one"), run(late, "two")], 0, false);
    assert.equal(joint.session, null);
    late.receive(hello());
    assert.deepEqual([joint.known.branches.length, joint.knowsLoss], [2, false]);
    joint.whole.value = { beforeLoss: 7, notes: [{ frame: 9, note: "they part" }] };
    assert.deepEqual([joint.knowsLoss, joint.beforeLoss], [true, 7]);
    assert.deepEqual(joint.known.bookmarks.map(({ frame, note }) => [frame, note]), [[9, "they part"]]);
  });
});

describe("the address of a comparison", () => {
  const runs = [{ recipe: { experiment: "ball", seed: 7 } }, { recipe: { experiment: "ball", tracker: "größe" } }];
  const address = (link) => new URL(link, "http://here/");

  it("holds what makes the runs, or names those of this server by references", () => {
    assert.deepEqual(wantedOf(address(linkTo({ runs, position: 5, arrangement: "over" }))), { runs, position: 5, arrangement: "over" });
    assert.deepEqual(wantedOf(address(linkTo({ runs }))), { runs, position: 0, arrangement: "side" });
    const references = ["ab", "cd:b1", "ef:3:apf"];
    assert.deepEqual(wantedOf(address(linkToReferences(references, 12))), { runs: references.map((reference) => ({ reference })), position: 12 });
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
    const [upper, lowest] = [false, true].map((isLowest) => ({ tint, isLowest }));
    const picture = { kind: "picture", name: "picture", layer: "picture" };
    const truth = { kind: "ellipse", name: "truth", layer: "truth", colour: black };
    assert.deepEqual([upper, lowest].map((way) => [coated(picture, way), coated(truth, way)]), [[null, null], [picture, truth]]);
    assert.deepEqual(coated({ kind: "polyline", colour: [0, 114, 178] }, upper), { kind: "polyline", colour: tint });
    const points = coated({ kind: "points", colours: new Uint8Array(6) }, lowest);
    assert.deepEqual([...points.colours], [...tint, ...tint]);
  });
});
