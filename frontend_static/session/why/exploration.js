/**
 * An exploration: work of the server beside a session, which is asked again and again for what it has found, and ended when
 * nobody wants to know any more. What it has found stays until there is something newer; where the session's run has changed
 * since, it is stale.
 */

import { messageOf, pathOf, request } from "../../shared/api.js";
import { cancelJob, followJob, jobOf } from "../../shared/jobs.js";
import { batch, signal } from "../../vendor/preact.js";

/** @import { ExplorationCreate, ExplorationJob, SessionPublic } from "../../shared/messages.js" */
/** @import { Store } from "../store.js" */

const sessions = pathOf("sessions");
/** The server forgets what has ended a little later. */
const KEPT_MS = 590_000;

export class Exploration {
  /** The newest one as it was told last, with the newest findings of any. */
  job = signal(/** @type {ExplorationJob|null} */ (null));
  /** Why there is nothing to tell, a sentence. */
  error = signal("");
  #store;
  #wanted = new AbortController();
  /** Until when the server knows it. */
  #until = Infinity;

  /**
   * @param {Store} store Of the session.
   * @param {AbortSignal} end It ends with it.
   */
  constructor(store, end) {
    this.#store = store;
    end.addEventListener("abort", () => this.stop());
    // Who leaves the page does not wait for answers.
    globalThis.addEventListener("pagehide", () => this.stop(), { signal: end });
  }

  get isWorking() {
    return this.job.value?.state === "working";
  }

  /**
   * Begin; what was under way ends.
   *
   * @param {ExplorationCreate} body
   */
  async begin(body) {
    this.stop();
    const wanted = (this.#wanted = new AbortController());
    this.error.value = "";
    this.#until = Infinity;
    try {
      /** @type {ExplorationJob} */
      const begun = await request("POST", sessions(this.#store.known.id, "explorations"), body);
      if (wanted.signal.aborted) {
        cancelJob(begun.id);
        return;
      }
      this.#take(begun);
      await followJob(begun, (now) => now && this.#take(now), wanted.signal);
      if (!wanted.signal.aborted) this.#until = performance.now() + KEPT_MS;
    } catch (error) {
      if (!wanted.signal.aborted) this.error.value = messageOf(error);
    }
  }

  /** End what is under way; what it has found stays. */
  stop() {
    this.#wanted.abort();
    const job = this.job.peek();
    if (job?.state !== "working") return;
    this.#until = 0;
    cancelJob(job.id);
    this.job.value = { ...job, state: "done" };
  }

  /** Ask whether what was found is still about the session's run. */
  async look() {
    const job = this.job.peek();
    if (job === null) return;
    const gone = { ...job, stale: true };
    /** @type {Promise<ExplorationJob>} */
    const asked = performance.now() > this.#until ? Promise.resolve(gone) : jobOf(job.id);
    const now = await asked.catch(() => gone);
    if (this.job.peek()?.id === job.id) this.#take(now);
  }

  /** @param {ExplorationJob} now */
  #take(now) {
    const before = this.job.peek();
    batch(() => {
      this.job.value = now.result === null && before?.result ? { ...now, result: before.result, branch: before.branch, stale: true } : now;
      if (now.state === "failed") this.error.value = now.error ?? "This could not be found out.";
    });
    // Changes to another branch can still be tried; changes to a run that was replaced cannot.
    if (now.stale && now.branch === this.#store.known.branch) this.stop();
  }
}

/**
 * What the runs of other seeds follow from: while it is the same, so are they.
 *
 * @param {SessionPublic} session
 */
export function settingsOf({ branch, recipe, restarts, timeline }) {
  return JSON.stringify([branch, recipe.seed, recipe.tracker, restarts, timeline]);
}
