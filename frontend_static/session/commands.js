/** What a person can do to a session besides moving through its run. */

import { api } from "../shared/api.js";
import { attempt, toast } from "../shared/toast.js";

/** @import { Command, MakeBranch } from "../shared/messages.js" */

export class Commands {
  #store;

  /** @param {import("./store.js").Store} store */
  constructor(store) {
    this.#store = store;
  }

  get #session() {
    return this.#store.known;
  }

  async bookmark(note = "") {
    if (!this.#store.isSteerable) return;
    const { position } = this.#session;
    await attempt(async () => {
      await api.bookmark(this.#session.id, note);
      toast(`Bookmarked frame ${position}`);
    });
  }

  /**
   * Leave the past for a new branch.
   *
   * @param {Omit<MakeBranch, "kind">} wanted
   * @returns {Promise<boolean>} Whether that was possible.
   */
  async branch(wanted) {
    return (await this.#send({ kind: "branch", ...wanted })) !== undefined;
  }

  /** @param {string} branch */
  async activate(branch) {
    await this.#send({ kind: "activate", branch });
  }

  async resume() {
    await attempt(() => api.resume(this.#session.id));
  }

  /** Stay at the frame that a run has come to on its way. */
  async stop() {
    await this.#send({ kind: "pause" });
  }

  /** @param {Command} command */
  #send(command) {
    return attempt(() => api.command(this.#session.id, command));
  }

  async save() {
    if (this.#store.session === null) return;
    await attempt(async () => {
      const run = await api.save(this.#session.id);
      toast("Saved; My work lists it", { action: { label: "Download", href: api.downloadAddress(run.id) } });
    });
  }
}
