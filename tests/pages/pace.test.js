import assert from "node:assert/strict";
import { describe, it } from "node:test";

import { Pace } from "../../frontend_static/session/clock.js";

const TELL_MS = 1000 / 30;

/** How far apart two runs are after a while, the second at the pace that is proposed four times a second. */
function apart({ rate, nominal = 30, behind, seconds = 4, delay = 0 }) {
  const pace = new Pace(nominal);
  let follower = -behind;
  let playing = nominal;
  let distance = behind;
  for (let step = 0; step < (seconds * 1000) / TELL_MS; step += 1) {
    const now = step * TELL_MS;
    const leader = Math.floor(((now - delay) * rate) / 1000);
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

  it("makes up what it is behind, and gives up what it is ahead", () => {
    for (const behind of [4, 12, -6]) assert.ok(Math.abs(apart({ rate: 30, behind })) < 1.5, `${behind} frames behind at first`);
  });

  it("is what the leader really makes, not what it should", () => {
    assert.ok(Math.abs(apart({ rate: 18, behind: 3, seconds: 6 })) < 1.5);
  });

  it("is never backwards, nor much faster than the leader", () => {
    const pace = new Pace(30);
    pace.heard(0, 0, 500);
    assert.ok(pace.rate > 0);
    pace.heard(10, 5000, 0);
    assert.ok(pace.rate < 60);
  });
});
