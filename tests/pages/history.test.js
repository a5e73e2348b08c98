import assert from "node:assert/strict";
import { describe, it } from "node:test";

import { eventsOf, numberOf, samplers, samplesOf, state, valueOf } from "../../frontend_static/session/readings.js";
import { curve, History, isGone } from "../../frontend_static/session/store.js";

const row = (frame, more = {}) => ({ frame, estimate: [frame, 0], ...more });
const filled = (length, more = () => ({})) => {
  const history = new History();
  for (let frame = 0; frame < length; frame += 1) history.add(row(frame, more(frame)));
  return history;
};

describe("a history of diagnostics", () => {
  it("appends rows without a new edition, so that plots only add the tail, and takes another estimate for a change", () => {
    const history = filled(3);
    history.add(row(1));
    assert.deepEqual([history.length, history.edition, history.at(2).frame, history.at(3)], [3, 0, 2, undefined]);
    history.add({ frame: 1, estimate: [99, 0] });
    assert.equal(history.edition, 1);
  });

  it("tells that rows in between are missing", () => {
    const history = filled(2);
    assert.deepEqual([2, 7].map((frame) => history.add(row(frame))), [true, false]);
  });

  it("merges columns into rows and keeps what the stream has brought meanwhile", () => {
    const history = filled(3, (frame) => (frame === 2 ? { error: 5 } : {}));
    history.merge({ frame: [0, 1], estimate: [[0, 0], [1, 0]], error: [1, null] });
    assert.deepEqual([history.length, history.at(0).error, history.at(2).error, history.edition], [3, 1, 5, 1]);
  });

  it("finds the spans in which something holds, one at the end included", () => {
    const history = filled(10, (frame) => ({ lost_since: { 2: 2, 3: 2, 9: 9 }[frame] ?? null }));
    assert.deepEqual([history.spans(isGone), history.some(isGone), filled(3).spans(isGone)], [[[2, 3], [9, 9]], true, []]);
  });
});

describe("values of a row", () => {
  it("are null or NaN where they are not known or not finite", () => {
    assert.deepEqual([{ error: null }, { error: Infinity }, undefined].map(curve.error), [null, null, null]);
    assert.deepEqual([[1, 3, 2], [null, 3], [null], []].map((sigma) => curve.sigma({ sigma })), [3, 3, null, null]);
    const valued = (...values) => valueOf(row(0, { series: { a: values } }), "a", 1);
    assert.deepEqual([valueOf(undefined, "a"), valued(1, null), valued(1, 2)], [NaN, NaN, 2]);
  });

  it("say that a target is gone by the truth or by the tracker itself", () => {
    assert.deepEqual([{ lost_since: 0 }, { lost_since: null }, undefined].map(isGone), [true, false, false]);
  });
});

describe("declared series", () => {
  const session = {
    series: [
      { name: "ess", role: "ess" },
      { name: "split", title: "split", role: "event", colours: ["prediction"] },
      { name: "gone", title: "refuted", role: "event", colours: [] },
      { name: "drawn", role: "share", components: ["prediction", "observation"], colours: ["prediction"] },
    ],
  };

  it("are found by their role, and are missing where a tracker does not report them", () => {
    const reported = [{ ess: 12, drawn: [3, 4] }, undefined].map((series) => row(0, series && { series }));
    assert.deepEqual(reported.map((each) => [numberOf(session, "ess", each), samplesOf(session, each)]), [[12, [3, 4]], [null, null]]);
    assert.deepEqual(samplers(session), [{ name: "prediction", colour: "prediction" }, { name: "observation", colour: "muted" }]);
  });

  it("say what happened in a frame", () => {
    const named = (series) => eventsOf(session, series && row(0, { series })).map(({ name }) => name);
    assert.deepEqual([named({ split: 0, gone: 2 }), named({ split: 1, gone: 1 }), named(undefined)], [["gone"], ["split", "gone"], []]);
  });
});

describe("the verdict on a frame", () => {
  const session = { position: 3, target: "window", frame_rate_hz: 30 };
  const UNKNOWN = { error: null, lost: null, hidden: null, searching: null, lost_since: null };
  const gone = { error: 63, lost: true, lost_since: 1, searching: false };
  const held = { error: 2, lost: false };
  const searching = { searching: true };

  for (const [source, before, now, said] of [
    ["the truth", {}, held, "held (by truth)"],
    ["the truth", {}, gone, "lost since 1 (by truth)"],
    ["the truth, in which nothing was found again", searching, gone, "lost since 1 (by truth)"],
    ["the truth", searching, { ...held, searching: false }, "window found again (by truth)"],
    ["the truth", {}, { error: 5, lost: false, hidden: true }, "hidden (by truth)"],
    ["the tracker", {}, { lost_since: 2, ...searching }, "lost since 2, looking for the window (by the tracker)"],
    ["both", {}, { error: 9, lost: true, lost_since: 2, ...searching }, "lost since 2, looking for the window (by truth and tracker)"],
    ["the tracker", searching, { searching: false }, "window found again (by the tracker)"],
    ["the tracker", {}, { searching: false }, "followed (by the tracker)"],
    ["both", {}, { ...held, ...searching }, "held (by truth), looking for the window (by the tracker)"],
    ["nobody", {}, {}, "truth not known"],
  ]) {
    it(`is that of ${source}: ${said}`, () => assert.equal(state(filled(4, (frame) => ({ ...UNKNOWN, ...(frame < 3 ? before : now) })), session)[0], said));
  }

  it("tells of what was found again for a second of the run", () => {
    const now = (rate) => state(filled(4, (frame) => ({ ...held, hidden: false, searching: frame === 1 })), { ...session, frame_rate_hz: rate })[0];
    assert.deepEqual([now(2), now(1)], ["window found again (by truth)", "held (by truth)"]);
  });
});
