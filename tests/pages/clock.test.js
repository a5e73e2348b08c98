import assert from "node:assert/strict";
import { describe, it } from "node:test";

import { keepUp, Pace } from "../../frontend_static/session/clock.js";
import { Store } from "../../frontend_static/session/store.js";
import { changes, hello } from "./making.js";

const TELL_MS = 1000 / 30;

/** How far apart two runs are after a while, the second at the pace that is proposed four times a second. */
function apart({ rate, nominal = 30, behind, seconds = 4 }) {
  const pace = new Pace(nominal);
  let [follower, playing, distance] = [-behind, nominal, behind];
  for (let step = 0; step < (seconds * 1000) / TELL_MS; step += 1) {
    const now = step * TELL_MS;
    const leader = Math.floor((now * rate) / 1000);
    follower += (playing * TELL_MS) / 1000;
    pace.heard(now, leader, Math.floor(follower));
    if (step % 8 === 7) playing = pace.rate;
    distance = leader - follower;
  }
  return distance;
}

describe("the pace of a session that follows", () => {
  it("is that of the leader while both are at the same frame", () => {
    const pace = new Pace(30);
    pace.heard(0, 5, 5);
    assert.equal(pace.rate, 30);
  });

  it("makes up what it is behind, gives up what it is ahead, and is what the leader really makes, not what it should", () => {
    for (const way of [{ rate: 30, behind: 4 }, { rate: 30, behind: 12 }, { rate: 30, behind: -6 }, { rate: 18, behind: 3, seconds: 6 }]) {
      assert.ok(Math.abs(apart(way)) < 1.5, JSON.stringify(way));
    }
  });
});

describe("sessions in step", () => {
  /** The store of the one that leads, that of the one that follows, and what the second was told: frames, and all else. */
  function together(more = {}, { first, ...other } = {}) {
    const [lead, store, goals, asked] = [new Store(), new Store(), [], []];
    const steering = {
      seek: (frame) => goals.push(frame), play: () => asked.push("play"), pause: () => asked.push("pause"), setSpeed: (speed) => asked.push(speed),
    };
    keepUp({ store, steering, first }, lead, new AbortController().signal);
    lead.receive(hello(more));
    store.receive(hello({ ...more, ...other }));
    return { lead, store, goals, asked };
  }
  const at = (frame, more = {}) => changes({ position: frame, computed: frame, goal: null, playing: false, speed: 1, ...more });
  const playing = (frame, speed = 1) => at(frame, { playing: true, speed });
  const LONG = { frame_rate_hz: 30, frames: 500 };

  it("follow the first one to its frame", () => {
    const { lead, store, goals } = together();
    for (const each of [lead, store]) each.receive(at(7));
    assert.deepEqual(goals, [7]);
  });

  it("ask no shorter run for more than it has", () => {
    const { lead, store, goals } = together();
    lead.receive(hello({ position: 30 }));
    goals.length = 0;
    store.receive(hello({ frames: 10, position: 9 }));
    assert.deepEqual(goals, []);
  });

  it("go at once to where the first one is still going", () => {
    const { lead, store, goals } = together();
    lead.receive(at(7, { goal: 40 }));
    assert.deepEqual(goals, [40]);
    store.receive(at(3, { goal: 40 }));
    lead.receive(at(9, { goal: 40 }));
    assert.deepEqual(goals, [40]);
  });

  it("play while the first one plays, and ask for no single frame", async () => {
    const { lead, store, goals, asked } = together(LONG);
    lead.receive(playing(1));
    assert.deepEqual([goals, asked], [[], ["play"]]);
    await new Promise(setImmediate);
    store.receive(playing(1));
    for (let frame = 2; frame < 6; frame += 1) lead.receive(playing(frame));
    assert.deepEqual(goals, []);
    await new Promise(setImmediate);
    lead.receive(playing(90));
    assert.deepEqual(goals, [90], "what is far away is gone to at once");
  });

  it("come to the very frame at which the first one stops, at its speed", () => {
    const { lead, store, goals, asked } = together(LONG);
    store.receive(playing(19, 1.2));
    goals.length = asked.length = 0;
    lead.receive(at(20));
    assert.deepEqual(goals, [20]);
    store.receive(at(20, { speed: 1.2 }));
    assert.deepEqual(asked, [1]);
  });

  it("are kept at the same picture where they begin at different ones, also where they play", () => {
    const { lead, goals } = together(LONG, { first: 3, position: 3 });
    lead.receive(changes({ position: 5 }));
    assert.deepEqual(goals, [8]);
    lead.receive(changes({ position: 40, playing: true }));
    assert.deepEqual(goals, [8, 43]);
  });
});
