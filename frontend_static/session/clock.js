/**
 * One clock for several sessions of a page: the first of them leads, and the others follow it. Whoever steers any of them
 * steers the first one. Runs on one recording may begin at different pictures: each says which of its frames belongs to
 * frame 0 of the one that leads.
 */

import { Follower } from "./follower.js";

/** @import { Steering } from "./steering.js" */
/** @import { Store } from "./store.js" */

/**
 * @typedef {object} Member
 * @property {Store} store
 * @property {Steering} steering
 * @property {number} [first] Its frame that belongs to frame 0 of the one that leads.
 */

export class Clock {
  /** @type {{member: Member, follower: Follower}[]} */
  #members = [];

  /** The session that leads, if there is any. */
  get leader() {
    return this.#members.at(0)?.member;
  }

  /**
   * @param {Member} member
   * @param {AbortSignal} signal Ends the membership; if it led, the next one leads.
   */
  join(member, signal) {
    const joined = { member, follower: new Follower(member.store, member.steering) };
    this.#members.push(joined);
    member.store.on(["position", "goal", "playing", "speed", "state", "connection"], () => this.#moved(joined));
    signal.addEventListener("abort", () => this.#leave(joined));
  }

  /** @param {{member: Member, follower: Follower}} left */
  #leave(left) {
    const [first] = this.#members;
    this.#members = this.#members.filter((other) => other !== left);
    const [next] = this.#members;
    if (next === undefined) return;
    const [before, now] = [left, next].map(({ member }) => member.store.session?.speed);
    // To follow, it went a little faster or slower.
    if (left === first && before !== undefined && before !== now) next.member.steering.setSpeed(before);
    this.#moved(next);
  }

  /** @param {{member: Member, follower: Follower}} moved */
  #moved(moved) {
    const [first, ...others] = this.#members;
    if (moved !== first) {
      const lead = first.member.store.session;
      if (lead !== null) moved.follower.follow(lead, moved.member.first);
      return;
    }
    // Each looks where it has to go, and shows again what it has of the leader: whether it plays, and how fast.
    for (const { member } of others) member.store.touch("position");
  }
}
