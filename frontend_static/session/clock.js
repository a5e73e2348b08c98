/**
 * Sessions of a page in step: one of them leads, and the others follow it. Runs on one recording may begin at different
 * pictures: each has the number of its frame that belongs to frame 0 of the leader.
 *
 * While the leader is paused, followers go to its frame. While it plays, they play at its measured rate, a little faster when
 * behind and a little slower when ahead, so that no frame needs a request of its own.
 *
 * Measured three times over ten seconds, with two sessions at 30 frames a second on a machine at six times its capacity: after
 * the first second the sessions were 1.0 frames apart on average and at most 2 to 3 in 95 % of the pictures, at 4 requests a
 * second. With a request for each frame they were 4.1 and 9 to 18 frames apart, at 15 requests a second.
 */

import { follow } from "../shared/timing.js";

/** @import { SessionPublic } from "../shared/messages.js" */
/** @import { Steering } from "./steering.js" */
/** @import { Store } from "./store.js" */

/** Window over which the leader's rate is measured, and the shortest usable one. */
const RATE_OVER_MS = 1000;
const KNOWN_AFTER_MS = 300;
/** Time in which a follower catches up. */
const MADE_UP_IN_MS = 600;
/** Largest change of speed for that, as a share of the rate. */
const MOST = 0.6;
/** Weight of the newest distance in the running mean. */
const NEWEST = 0.3;
/** Smaller distances are jitter of the messages. */
const UNSEEN_FRAMES = 0.5;

export class Pace {
  /** @type {{now: number, frame: number}[]} */
  #heard = [];
  /** @type {number|null} */
  #distance = null;
  #nominal;

  /** @param {number} nominal Frames per second of the leader, until its rate is measured. */
  constructor(nominal) {
    this.#nominal = nominal;
  }

  /** Note the frames of both.
   *
   * @param {number} now ms
   * @param {number} leader Frame.
   * @param {number} follower Frame.
   */
  heard(now, leader, follower) {
    if (this.#heard.at(-1)?.frame !== leader) this.#heard.push({ now, frame: leader });
    while (this.#heard.length > 2 && now - this.#heard[1].now > RATE_OVER_MS) this.#heard.shift();
    const distance = leader - follower;
    this.#distance = this.#distance === null ? distance : this.#distance + NEWEST * (distance - this.#distance);
  }

  /** Frames per second at which the follower should play now. */
  get rate() {
    const rate = this.#leaderRate;
    const distance = this.#distance ?? 0;
    if (Math.abs(distance) < UNSEEN_FRAMES) return rate;
    const more = distance / (MADE_UP_IN_MS / 1000);
    return rate + Math.min(Math.max(more, -MOST * rate), MOST * rate);
  }

  get #leaderRate() {
    const [first, last] = [this.#heard.at(0), this.#heard.at(-1)];
    if (!first || !last || last.now - first.now < KNOWN_AFTER_MS) return this.#nominal;
    return Math.max(((last.frame - first.frame) * 1000) / (last.now - first.now), 0);
  }
}

/** A follower further away than this seeks. */
const AWAY_S = 1;
/** Time between two corrections of the speed, */
const CORRECT_EVERY_MS = 250;
/** and the smallest one, as a share of the speed. */
const CORRECTION = 0.04;
/** Speeds that a session accepts, times real time. */
const SLOWEST = 0.1;
const FASTEST = 10;

class Follower {
  #member;
  /** @type {Pace|null} While the leader plays. */
  #pace = null;
  #isBusy = false;
  #corrected = 0;

  /** @param {Member} member */
  constructor(member) {
    this.#member = member;
  }

  /** Seek to the leader's frame, or play along with it.
   *
   * @param {SessionPublic} leader
   */
  follow(leader) {
    const { store: { session: own, isSteerable }, first = 0 } = this.#member;
    if (own === null || !isSteerable) return;
    const lead = { ...leader, position: leader.position + first };
    // A long seek takes a while, so both seek at the same time.
    const goal = Math.min((leader.goal ?? leader.position) + first, own.frames - 1);
    // "As fast as possible" has no rate, and a run pauses at its end.
    if (lead.playing && lead.speed > 0 && goal < own.frames - 1) this.#goAlong(lead, own);
    else this.#stand(lead, own, goal);
  }

  /**
   * @param {SessionPublic} lead
   * @param {SessionPublic} own
   * @param {number} goal
   */
  #stand(lead, own, goal) {
    const { steering } = this.#member;
    this.#pace = null;
    if (own.position !== goal) {
      if (own.goal !== goal) steering.seek(goal);
    } else if (own.playing) this.#once(() => steering.pause());
    else if (own.speed !== lead.speed) this.#once(() => steering.setSpeed(lead.speed));
  }

  /**
   * @param {SessionPublic} lead
   * @param {SessionPublic} own
   */
  #goAlong(lead, own) {
    const { steering } = this.#member;
    const now = performance.now();
    this.#pace ??= new Pace(lead.frame_rate_hz * lead.speed);
    this.#pace.heard(now, lead.position, own.position);
    const speed = Math.min(Math.max(this.#pace.rate / own.frame_rate_hz, SLOWEST), FASTEST);
    const isAway = Math.abs(lead.position - own.position) > AWAY_S * lead.frame_rate_hz * lead.speed;
    if (isAway) this.#once(() => steering.seek(lead.position));
    else if (!own.playing) this.#once(() => steering.play());
    else if (now - this.#corrected >= CORRECT_EVERY_MS && Math.abs(speed / own.speed - 1) >= CORRECTION) {
      this.#corrected = now;
      this.#once(() => steering.setSpeed(speed));
    }
  }

  /**
   * Make one request at a time; the next message shows what is left to do.
   *
   * @param {() => Promise<void>} work
   */
  async #once(work) {
    if (this.#isBusy) return;
    this.#isBusy = true;
    try {
      await work();
    } finally {
      this.#isBusy = false;
    }
  }
}

/**
 * @typedef {object} Member
 * @property {Store} store
 * @property {Steering} steering
 * @property {number} [first] Its frame that belongs to frame 0 of the leader.
 */

/** Keep a session at the leader's frame.
 *
 * @param {Member} member
 * @param {Store} lead
 * @param {AbortSignal} end
 */
export function keepUp(member, lead, end) {
  const follower = new Follower(member);
  follow(() => [movesOf(lead), movesOf(member.store)], () => lead.session && follower.follow(lead.session), end);
}

/** The fields that determine a session's position and movement.
 *
 * @param {Store} store
 */
function movesOf({ connection, session }) {
  return [connection.value, session?.state, session?.position, session?.goal, session?.playing, session?.speed];
}
