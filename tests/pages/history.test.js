import assert from "node:assert/strict";
import { describe, it } from "node:test";

import { eventsOf, frequencies, isKnown, numberOf, samplers, samplesOf, state, valueOf } from "../../frontend_static/session/readings.js";
import { curve, History, isGone } from "../../frontend_static/session/store.js";

const row = (frame, more = {}) => ({ frame, estimate: [frame, 0], ...more });
const filled = (length, more = () => ({})) => {
  const history = new History();
  for (let frame = 0; frame < length; frame += 1) history.add(row(frame, more(frame)));
  return history;
};

describe("a history of diagnostics", () => {
  it("appends rows without a new edition, so that plots only add the tail", () => {
    const history = filled(3);
    assert.equal(history.length, 3);
    assert.equal(history.edition, 0);
    assert.equal(history.at(2).frame, 2);
    assert.equal(history.at(3), undefined);
  });

  it("tells that rows in between are missing", () => {
    const history = filled(2);
    assert.equal(history.add(row(2)), true);
    assert.equal(history.add(row(7)), false);
  });

  it("takes a replayed row for the same one, and another estimate for a change", () => {
    const history = filled(3);
    history.add(row(1));
    assert.equal(history.edition, 0);
    history.add({ frame: 1, estimate: [99, 0] });
    assert.equal(history.edition, 1);
  });

  it("merges columns into rows and keeps what the stream has brought meanwhile", () => {
    const history = filled(0);
    history.add(row(0));
    history.add(row(1));
    history.add(row(2, { error: 5 }));
    history.merge({ frame: [0, 1], estimate: [[0, 0], [1, 0]], error: [1, null] });
    assert.equal(history.length, 3);
    assert.equal(history.at(0).error, 1);
    assert.equal(history.at(2).error, 5);
    assert.equal(history.edition, 1);
  });

  it("replaces everything, also by nothing", () => {
    const history = filled(4);
    history.replace({ frame: [0], error: [2] });
    assert.equal(history.length, 1);
    history.replace({});
    assert.equal(history.length, 0);
  });

  it("shares a parent's past up to and including a frame, and then goes its own way", () => {
    const parent = filled(5);
    const branch = new History();
    branch.share(parent, 2);
    branch.add(row(3, { error: 1 }));
    assert.equal(branch.length, 4);
    assert.equal(parent.at(3).error, undefined);
  });

  it("finds the spans in which something holds, one at the end included", () => {
    const history = filled(10, (frame) => ({ lost_since: { 2: 2, 3: 2, 9: 9 }[frame] ?? null }));
    assert.deepEqual(history.spans(isGone), [[2, 3], [9, 9]]);
    assert.equal(history.some(isGone), true);
    assert.deepEqual(filled(3).spans(isGone), []);
  });
});

describe("values of a row", () => {
  it("are null or NaN where they are not known or not finite", () => {
    assert.equal(curve.error({ error: null }), null);
    assert.equal(curve.error({ error: Infinity }), null);
    assert.equal(curve.error(undefined), null);
    assert.deepEqual([[1, 3, 2], [null, 3], [null], []].map((sigma) => curve.sigma({ sigma })), [3, 3, null, null]);
    assert.ok(Number.isNaN(valueOf(undefined, "a")));
    assert.ok(Number.isNaN(valueOf(row(0, { series: { a: [1, null] } }), "a", 1)));
    assert.equal(valueOf(row(0, { series: { a: [1, 2] } }), "a", 1), 2);
  });

  it("say that a target is gone by the truth or by the tracker itself", () => {
    assert.equal(isGone({ lost_since: 0 }), true);
    assert.equal(isGone({ lost_since: null }), false);
    assert.equal(isGone(undefined), false);
  });

  it("add up to the share of ones so far; unknown ones do not count", () => {
    const values = [[1, 0], [null, 1], [1, 1]];
    const history = filled(3, (frame) => ({ series: { seen: values[frame] } }));
    assert.deepEqual(frequencies(history, "seen"), [1 / 2, 2 / 3, 4 / 5]);
    assert.ok(Number.isNaN(frequencies(filled(1), "seen")[0]));
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
    const known = row(0, { series: { ess: 12, drawn: [3, 4] } });
    assert.equal(numberOf(session, "ess", known), 12);
    assert.deepEqual(samplesOf(session, known), [3, 4]);
    assert.equal(numberOf(session, "ess", row(0)), null);
    assert.equal(samplesOf(session, row(0)), null);
    assert.deepEqual(samplers(session), [{ name: "prediction", colour: "prediction" }, { name: "observation", colour: "muted" }]);
  });

  it("say what happened in a frame", () => {
    const named = (series) => eventsOf(session, row(0, { series })).map(({ name }) => name);
    assert.deepEqual([named({ split: 0, gone: 2 }), named({ split: 1, gone: 1 })], [["gone"], ["split", "gone"]]);
    assert.deepEqual(eventsOf(session, undefined), []);
  });

  it("are measured from the first known value on", () => {
    const history = filled(2, (frame) => ({ series: { a: frame === 1 ? [null, 3] : [null, null], b: { values: [], weights: [] } } }));
    assert.equal(history.measures("a"), true);
    assert.equal(history.measures("b"), false);
    assert.deepEqual([isKnown(null), isKnown(0), isKnown({ values: [[1]], weights: [1] })], [false, true, true]);
  });
});

describe("the verdict on a frame", () => {
  const session = { position: 3, target: "window", frame_rate_hz: 30 };
  const verdict = (before, now) => {
    const history = filled(4, (frame) => ({ error: null, lost: null, hidden: null, searching: null, lost_since: null, ...(frame < 3 ? before : now) }));
    return state(history, session)[0];
  };

  it("is that of the truth where that is known, and names its source", () => {
    assert.equal(verdict({}, { error: 2, lost: false }), "held (by truth)");
    assert.equal(verdict({}, { error: 63, lost: true, lost_since: 1, searching: false }), "lost since 1 (by truth)");
    assert.equal(verdict({ searching: true }, { error: 63, lost: true, lost_since: 1, searching: false }), "lost since 1 (by truth)");
    assert.equal(verdict({ searching: true }, { error: 2, lost: false, searching: false }), "window found again (by truth)");
    assert.equal(verdict({}, { error: 5, lost: false, hidden: true }), "hidden (by truth)");
  });

  it("tells of what was found again for a second of the run", () => {
    const now = (rate) => state(filled(4, (frame) => ({ error: 2, lost: false, hidden: false, searching: frame === 1 })), { ...session, frame_rate_hz: rate })[0];
    assert.deepEqual([now(2), now(1)], ["window found again (by truth)", "held (by truth)"]);
  });

  it("is the tracker's own account where nobody else knows", () => {
    assert.equal(verdict({}, { lost_since: 2, searching: true }), "lost since 2, looking for the window (by the tracker)");
    assert.equal(verdict({}, { error: 9, lost: true, lost_since: 2, searching: true }), "lost since 2, looking for the window (by truth and tracker)");
    assert.equal(verdict({ searching: true }, { searching: false }), "window found again (by the tracker)");
    assert.equal(verdict({}, { searching: false }), "followed (by the tracker)");
    assert.equal(verdict({}, { error: 2, lost: false, searching: true }), "held (by truth), looking for the window (by the tracker)");
    assert.equal(verdict({}, {}), "truth not known");
  });
});
