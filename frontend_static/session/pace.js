/**
 * How fast a run has to play to keep up with another one: as fast as that one really goes, and a little faster or slower
 * while it is behind or ahead. Both are only heard of now and then, so the rate and the distance are taken over a while.
 */

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
