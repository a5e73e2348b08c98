/**
 * One clock for several sessions of a page: the first of them leads, and the others go to the frame where it is. Whoever
 * steers any of them steers the first one.
 */

/** @typedef {{store: import("./store.js").Store, steering: import("./steering.js").Steering}} Member */

export class Clock {
  /** @type {Member[]} */
  #members = [];

  /** The session that leads, if there is any. */
  get leader() {
    return this.#members.at(0);
  }

  /**
   * @param {Member} member
   * @param {AbortSignal} signal Ends the membership; if it led, the next one leads.
   */
  join(member, signal) {
    this.#members.push(member);
    member.store.on(["position", "session", "connection"], () => this.#moved(member));
    signal.addEventListener("abort", () => {
      this.#members = this.#members.filter((other) => other !== member);
      if (this.leader) this.#moved(this.leader);
    });
  }

  /** @param {Member} member */
  #moved(member) {
    if (member !== this.leader) {
      this.#follow(member);
      return;
    }
    // Each looks where it has to go, and shows again what it has of the leader: whether it plays, and how fast.
    for (const follower of this.#members.slice(1)) follower.store.touch("position");
  }

  /** @param {Member} follower */
  #follow({ store, steering }) {
    const lead = this.leader?.store.session;
    if (!lead || store.session === null || store.connection !== "open") return;
    if (store.session.position !== Math.min(lead.position, store.session.frames - 1)) steering.seek(lead.position);
  }
}
