import assert from "node:assert/strict";
import { beforeEach, describe, it } from "node:test";

import { keepUp } from "../../frontend_static/session/clock.js";
import { bookmark, Steering } from "../../frontend_static/session/steering.js";
import { Store } from "../../frontend_static/session/store.js";
import { effect } from "../../frontend_static/vendor/preact.js";

const changes = (session, rows = []) => ({ type: "changes", session, rows });

const hello = (more = {}) => ({
  type: "hello",
  diagnostics: { frame: [0], error: [1], estimate: [[0]] },
  session: {
    id: "s", state: "ready", branch: "b0", branches: [{ id: "b0", parent: null, frame: 0 }], position: 0, computed: 0, goal: null, frames: 50,
    playing: false, speed: 1, speeds: [0.5, 1, 0], timeline: [], thresholds: [], parameters: { n: 1 }, tracker: "a", bookmarks: [], ...more,
  },
});

describe("the store of a session", () => {
  let store;

  beforeEach(() => {
    store = new Store();
  });

  it("hears nothing before it was greeted", () => {
    store.receive(changes({ position: 5 }));
    assert.equal(store.session, null);
    assert.equal(store.isAwake, false);
    assert.throws(() => store.known, /has not been loaded/);
  });

  it("knows where a run is on its way to, until it is there", () => {
    store.receive(hello({ goal: 40 }));
    store.receive(changes({ position: 5, computed: 5 }));
    assert.equal(store.known.goal, 40);
    store.receive(changes({ position: 40, computed: 40, goal: null }));
    assert.equal(store.known.goal, null);
  });

  it("knows the frames that were computed as soon as it stands on one of them", () => {
    store.receive(hello());
    const known = [];
    effect(() => void known.push([store.history.length, store.history.at(store.known.position)?.frame]));
    store.receive(changes({ position: 2, computed: 2 }, [{ frame: 1 }, { frame: 2 }]));
    assert.deepEqual(known, [[1, 0], [3, 2]]);
  });

  it("is followed field by field, and its history by rows, by whatever reads them", () => {
    const [positions, speeds, frames] = [[], [], []];
    effect(() => void positions.push(store.session?.position));
    effect(() => void speeds.push(store.session?.speed));
    effect(() => void frames.push(store.history.length));
    store.receive(hello());
    store.receive(changes({ position: 1, computed: 1 }, [{ frame: 1 }, { frame: 2 }]));
    store.receive(hello({ position: 1 }));
    assert.deepEqual(positions, [undefined, 0, 1]);
    assert.deepEqual(speeds, [undefined, 1]);
    assert.deepEqual(frames, [0, 1, 3, 1]);
  });

  it("takes everything over from a greeting", () => {
    store.receive(hello());
    assert.equal(store.connection.value, "open");
    assert.equal(store.history.length, 1);
    assert.equal(store.isAwake, true);
  });

  it("has a view of several fields drawn once for a message, also for a field that is new", () => {
    store.receive(hello());
    const drawn = [];
    effect(() => void drawn.push([store.known.position, store.known.speed, ...store.lengths]));
    store.receive(changes({ position: 7, speed: 2, anything_new: 0.5 }, [{ frame: 1 }]));
    assert.deepEqual(drawn, [[0, 1, 1], [7, 2, 2]]);
    assert.equal(store.known.anything_new, 0.5);
  });

  it("takes the whole timeline over from a change, without asking for anything", () => {
    store.receive(hello());
    const timeline = [{ frame: 4, values: { n: 2 }, before: { n: 1 } }];
    const thresholds = [{ name: "n", of: "sigma", steps: [{ frame: 0, value: 1 }, { frame: 4, value: 2 }] }];
    store.receive(changes({ parameters: { n: 2 }, timeline, thresholds }));
    assert.deepEqual(store.known.timeline, timeline);
    assert.deepEqual(store.known.thresholds, thresholds);
    assert.deepEqual(store.known.parameters, { n: 2 });
  });

  it("gives a new branch its parent's past", () => {
    store.receive(hello());
    store.receive(changes({}, [{ frame: 1, estimate: [1] }, { frame: 2, estimate: [2] }]));
    const branches = [{ id: "b0", parent: null, frame: 0 }, { id: "b1", parent: "b0", frame: 1 }];
    store.receive(changes({ branches }));
    assert.equal(store.historyOf("b1").length, 2);
    assert.equal(store.history.length, 3);
  });

  it("no longer listens where its worker has ended", () => {
    store.receive(hello({ playing: true, state: "playing" }));
    store.receive(changes({ state: "crashed", message: "it ended", playing: false }));
    assert.equal(store.known.playing, false);
    assert.equal(store.isAwake, false);
  });
});

describe("a session that one may only look at", () => {
  it("is awake like any, and is asked for nothing", async (context) => {
    const asked = context.mock.method(globalThis, "fetch", () => Promise.reject(new Error("nothing is asked for")));
    const store = new Store({ readOnly: true });
    store.receive(hello({ position: 10 }));
    assert.equal(store.isAwake, true);
    assert.equal(store.isSteerable, false);
    const steering = new Steering(store, new AbortController().signal);
    for (const act of ["toggle", "play", "newest", "beforeLoss"]) await steering[act]();
    await steering.seek(2);
    await steering.step(1);
    await steering.setSpeed(2);
    await bookmark(store);
    assert.equal(asked.mock.callCount(), 0);
    assert.equal(store.known.speed, 1);
  });
});

describe("sessions in step", () => {
  const member = () => {
    const store = new Store();
    const goals = [];
    const asked = [];
    const steering = {
      seek: (frame) => goals.push(frame),
      play: () => asked.push("play"),
      pause: () => asked.push("pause"),
      setSpeed: (speed) => asked.push(speed),
    };
    return { store, goals, asked, steering };
  };
  const together = (more = {}) => {
    const members = [member(), member()];
    keepUp(members[1], members[0].store, new AbortController().signal);
    for (const { store } of members) store.receive(hello(more));
    return members;
  };
  const at = (frame, more = {}) => changes({ position: frame, computed: frame, goal: null, playing: false, speed: 1, ...more });

  it("follow the first one to its frame", () => {
    const [first, second] = together();
    first.store.receive(at(7));
    assert.deepEqual(second.goals, [7]);
    second.store.receive(at(7));
    assert.deepEqual([first.goals, second.goals], [[], [7]]);
  });

  it("ask no shorter run for more than it has", () => {
    const [first, second] = together();
    first.store.receive(hello({ position: 30 }));
    second.goals.length = 0;
    second.store.receive(hello({ frames: 10, position: 9 }));
    assert.deepEqual(second.goals, []);
  });

  it("go at once to where the first one is still going", () => {
    const [first, second] = together();
    first.store.receive(at(7, { goal: 40 }));
    assert.deepEqual(second.goals, [40]);
    second.store.receive(at(3, { goal: 40 }));
    first.store.receive(at(9, { goal: 40 }));
    assert.deepEqual(second.goals, [40]);
  });

  const playing = (frame, speed = 1) => at(frame, { playing: true, speed });

  it("play while the first one plays, and ask for no single frame", async () => {
    const [first, second] = together({ frame_rate_hz: 30, frames: 500 });
    first.store.receive(playing(1));
    assert.deepEqual([second.goals, second.asked], [[], ["play"]]);
    await new Promise(setImmediate);
    second.store.receive(playing(1));
    for (let frame = 2; frame < 6; frame += 1) first.store.receive(playing(frame));
    assert.deepEqual(second.goals, []);
    await new Promise(setImmediate);
    first.store.receive(playing(90));
    assert.deepEqual(second.goals, [90], "what is far away is gone to at once");
  });

  it("come to the very frame at which the first one stops, at its speed", () => {
    const [first, second] = together({ frame_rate_hz: 30, frames: 500 });
    second.store.receive(playing(19, 1.2));
    second.goals.length = second.asked.length = 0;
    first.store.receive(at(20));
    assert.deepEqual(second.goals, [20]);
    second.store.receive(at(20, { speed: 1.2 }));
    assert.deepEqual(second.asked, [1]);
  });
});
