/**
 * A session that shows the frame that another one shows. While that one stands it goes to the same frame; while it plays
 * it plays, too, at the pace of the other one (`pace.js`), so that nothing has to be asked for each frame.
 *
 * Measured for ten seconds, three times, on two sessions of 30 frames a second and a machine with six times as much to do
 * as it has processors for: from the second second on they were 1.0 frames apart on average and at most 2 to 3 in 95 of 100
 * pictures, with 4 requests a second. When the second one went to each frame of the first they were 4.1 and 9 to 18 frames
 * apart, with 15 requests a second.
 */

import { Pace } from "./pace.js";

/** @import { SessionPublic } from "../shared/messages.js" */
/** @import { Steering } from "./steering.js" */
/** @import { Store } from "./store.js" */

/** Further away than this it goes there at once. */
const AWAY_S = 1;
/** Between two corrections of its speed, */
const CORRECT_EVERY_MS = 250;
/** none of which is smaller than this share. */
const CORRECTION = 0.04;
/** Speeds that a session takes, times real time. */
const SLOWEST = 0.1;
const FASTEST = 10;

export class Follower {
  #store;
  #steering;
  /** @type {Pace|null} While the leader plays. */
  #pace = null;
  #isBusy = false;
  #corrected = 0;

  /**
   * @param {Store} store
   * @param {Steering} steering
   */
  constructor(store, steering) {
    this.#store = store;
    this.#steering = steering;
  }

  /**
   * Go where the leader is, or along with it.
   *
   * @param {SessionPublic} leader
   * @param {number} [first] The own frame that belongs to the leader's frame 0.
   */
  follow(leader, first = 0) {
    const { session: own, connection } = this.#store;
    if (own === null || connection !== "open") return;
    const lead = { ...leader, position: leader.position + first };
    // A long way is computed frame by frame; both go it at the same time.
    const goal = Math.min((leader.goal ?? leader.position) + first, own.frames - 1);
    // As fast as possible has no pace, and at its end a run stands.
    if (lead.playing && lead.speed > 0 && goal < own.frames - 1) this.#goAlong(lead, own);
    else this.#stand(lead, own, goal);
  }

  /**
   * @param {SessionPublic} lead
   * @param {SessionPublic} own
   * @param {number} goal
   */
  #stand(lead, own, goal) {
    this.#pace = null;
    if (own.position !== goal) {
      if (own.goal !== goal) this.#steering.seek(goal);
    } else if (own.playing) this.#once(() => this.#steering.pause());
    else if (own.speed !== lead.speed) this.#once(() => this.#steering.setSpeed(lead.speed));
  }

  /**
   * @param {SessionPublic} lead
   * @param {SessionPublic} own
   */
  #goAlong(lead, own) {
    const now = performance.now();
    this.#pace ??= new Pace(lead.frame_rate_hz * lead.speed);
    this.#pace.heard(now, lead.position, own.position);
    if (Math.abs(lead.position - own.position) > AWAY_S * lead.frame_rate_hz * lead.speed) {
      this.#once(() => this.#steering.seek(lead.position));
      return;
    }
    if (!own.playing) {
      this.#once(() => this.#steering.play());
      return;
    }
    const speed = Math.min(Math.max(this.#pace.rate / own.frame_rate_hz, SLOWEST), FASTEST);
    if (now - this.#corrected < CORRECT_EVERY_MS || Math.abs(speed / own.speed - 1) < CORRECTION) return;
    this.#corrected = now;
    this.#once(() => this.#steering.setSpeed(speed));
  }

  /**
   * Ask for one thing at a time; what is next is seen when it is done.
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
