/**
 * One clock for several sessions of a page: the first of them leads, and the others follow it. Steering any of them
 * steers the first one. Runs on one recording may begin at different pictures: each says which of its frames belongs to
 * frame 0 of the one that leads.
 *
 * While the leader stands the others go to the same frame; while it plays they play, too, as fast as it really goes, and a
 * little faster or slower while they are behind or ahead, so that nothing has to be asked for each frame.
 *
 * Measured for ten seconds, three times, on two sessions of 30 frames a second and a machine with six times as much to do
 * as it has processors for: from the second second on they were 1.0 frames apart on average and at most 2 to 3 in 95 of 100
 * pictures, with 4 requests a second. When the second one went to each frame of the first they were 4.1 and 9 to 18 frames
 * apart, with 15 requests a second.
 */

import { follow } from "../shared/effects.js";
import { batch, signal } from "../vendor/preact.js";

/** @import { SessionPublic } from "../shared/messages.js" */
/** @import { Steering } from "./steering.js" */
/** @import { Store } from "./store.js" */

/** The rate is that of the last second, */
const RATE_OVER_MS = 1000;
/** at least of so long, */
const KNOWN_AFTER_MS = 300;
/** and a distance is made up in about this time, */
const MADE_UP_IN_MS = 600;
/** by going at most so much faster or slower. */
const MOST = 0.6;
/** How much the newest distance counts beside those before it. */
const NEWEST = 0.3;
/** A distance of less is that of messages, which do not come at the same time. */
const UNSEEN_FRAMES = 0.5;

export class Pace {
  /** @type {{now: number, frame: number}[]} */
  #heard = [];
  /** @type {number|null} */
  #distance = null;
  #nominal;

  /** @param {number} nominal Frames a second of the leader, as long as it has not been heard for a while. */
  constructor(nominal) {
    this.#nominal = nominal;
  }

  /**
   * Take note of where both are.
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

  /** Frames a second at which the follower should play now. */
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

/** Further away than this it goes there at once. */
const AWAY_S = 1;
/** Between two corrections of its speed, */
const CORRECT_EVERY_MS = 250;
/** and the smallest one, as a share of the speed. */
const CORRECTION = 0.04;
/** Speeds that a session takes, times real time. */
const SLOWEST = 0.1;
const FASTEST = 10;

class Follower {
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

/**
 * @typedef {object} Member
 * @property {Store} store
 * @property {Steering} steering
 * @property {number} [first] Its frame that belongs to frame 0 of the one that leads.
 */

export class Clock {
  #members = signal(/** @type {readonly Member[]} */ ([]));

  /** The session that leads, if there is any; components that read it follow it. */
  get leader() {
    return this.#members.value.at(0);
  }

  /**
   * @param {Member} member
   * @param {AbortSignal} end Ends the membership; if it led, the next one leads.
   */
  join(member, end) {
    const follower = new Follower(member.store, member.steering);
    this.#members.value = [...this.#members.peek(), member];
    const move = () => {
      const lead = this.leader;
      if (lead !== member && lead?.store.session) follower.follow(lead.store.session, member.first);
    };
    follow(() => [movesOf(this.leader), movesOf(member)], move, end);
    end.addEventListener("abort", () => this.#leave(member));
  }

  /** @param {Member} left */
  #leave(left) {
    const [first] = this.#members.peek();
    batch(() => {
      this.#members.value = this.#members.peek().filter((other) => other !== left);
      const next = this.leader;
      const [before, now] = [left, next].map((member) => member?.store.session?.speed);
      // To follow, it went a little faster or slower.
      if (left === first && before !== undefined && before !== now) next?.steering.setSpeed(before);
    });
  }
}

/**
 * What decides where a member is and where it goes.
 *
 * @param {Member|undefined} member
 */
function movesOf(member) {
  const { connection, session } = member?.store ?? {};
  return [connection, session?.state, session?.position, session?.goal, session?.playing, session?.speed];
}
