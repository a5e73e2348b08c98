/** What a person can do to a session. Buttons, keys and the scrubber all end up here. */

import { api } from "../shared/api.js";
import { beforeLoss } from "./history.js";
import { latest } from "../shared/timing.js";
import { attempt, toast } from "../shared/toast.js";

const GOAL_MS = 2000;
export const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 5, 10, 0];

export class Commands {
  #store;
  #seeking;
  /** The frame that was asked for and is not shown yet; keys that come meanwhile count from there. */
  #goal = null;

  /** @param {import("./store.js").Store} store */
  constructor(store) {
    this.#store = store;
    this.#seeking = latest((frame) => this.#send("seek", { frame }));
    store.on("position", () => {
      if (store.session.position === this.#goal) this.#goal = null;
    });
  }

  get #session() {
    return this.#store.session;
  }

  /** Whether there is a session that listens. */
  get able() {
    return this.#session !== null && !["starting", "suspended", "crashed"].includes(this.#session.state);
  }

  async toggle() {
    if (!this.able) return;
    if (this.#session.playing) await this.#send("pause");
    else {
      if (this.#session.position >= this.#session.frames - 1) await this.#send("seek", { frame: 0 });
      await this.#send("play");
    }
  }

  async pause() {
    if (this.able && this.#session.playing) await this.#send("pause");
  }

  /** One frame on or back. */
  async step(direction) {
    if (!this.able) return;
    const at = this.#session.position;
    if (direction > 0 ? at < this.#session.frames - 1 : at > 0) await this.#send(direction > 0 ? "step" : "back");
  }

  /** Go to a frame and stay there. While one seek is under way only the newest wish is kept. */
  async seek(frame) {
    if (!this.able) return;
    const goal = Math.min(Math.max(0, Math.round(frame)), this.#session.frames - 1);
    this.#goal = goal;
    setTimeout(() => this.#goal === goal && (this.#goal = null), GOAL_MS);
    await this.pause();
    await this.#seeking(goal);
  }

  async jump(frames) {
    if (this.able) await this.seek((this.#goal ?? this.#session.position) + frames);
  }

  async first() {
    await this.seek(0);
  }

  /** The newest frame that has been computed; computing all the rest could take long. */
  async newest() {
    if (this.able) await this.seek(this.#session.head);
  }

  async beforeLoss() {
    if (!this.able) return;
    const frame = beforeLoss(this.#store.history, this.#session.position);
    if (frame === null) toast("The target has not been lost so far");
    else await this.seek(frame);
  }

  async speed(value) {
    if (!this.able) return;
    this.#store.setSpeed(value);
    await this.#send("speed", { speed: value });
  }

  async faster(direction) {
    if (!this.able) return;
    const now = this.#session.speed === 0 ? Infinity : this.#session.speed;
    const rank = SPEEDS.map((speed) => (speed === 0 ? Infinity : speed));
    const next = direction > 0 ? rank.find((speed) => speed > now) : rank.findLast((speed) => speed < now);
    if (next !== undefined) await this.speed(next === Infinity ? 0 : next);
  }

  async restart() {
    if (this.able) await this.#send("restart");
  }

  async bookmark(note = "") {
    if (!this.able) return;
    const { position } = this.#session;
    await attempt(async () => {
      await api.bookmark(this.#session.id, note);
      toast(`Bookmarked frame ${position}`);
    });
  }

  /** Leave the past for a new branch; tells whether that was possible. */
  async branch(wish) {
    return (await attempt(() => api.branch(this.#session.id, wish))) !== undefined;
  }

  async activate(branch) {
    await attempt(() => api.activate(this.#session.id, branch));
  }

  async resume() {
    await attempt(() => api.resume(this.#session.id));
  }

  async save() {
    if (this.#session === null) return;
    await attempt(async () => {
      const run = await api.save(this.#session.id);
      toast("Saved; the gallery lists it", { action: { label: "Download", href: api.downloadAddress(run.id) } });
    });
  }

  async #send(action, more) {
    await attempt(() => api.transport(this.#session.id, action, more));
  }
}
