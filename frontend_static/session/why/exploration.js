/**
 * An exploration: work of the server beside a session. The page polls it for its findings, and ends it when it no longer needs
 * them. Findings stay until there are newer ones; they are stale once the session's run has changed.
 */

import { messageOf, pathOf, request } from "../../shared/api.js";
import { cancelJob, followJob, jobOf } from "../../shared/jobs.js";
import { batch, signal } from "../../vendor/preact.js";

/** @import { ExplorationCreate, ExplorationJob, SessionPublic } from "../../shared/messages.js" */
/** @import { Store } from "../store.js" */

const sessions = pathOf("sessions");
/** The server forgets a finished job a little later. */
const KEPT_MS = 590_000;

export class Exploration {
  /** The newest job, with the newest findings of any job. */
  job = signal(/** @type {ExplorationJob|null} */ (null));
  /** Why there are no findings, a sentence. */
  error = signal("");
  #store;
  #wanted = new AbortController();
  /** Until when the server knows the job. */
  #until = Infinity;

  /**
   * @param {Store} store Of the session.
   * @param {AbortSignal} end Ends the exploration.
   */
  constructor(store, end) {
    this.#store = store;
    end.addEventListener("abort", () => this.stop());
    // A page that is left reads no answers.
    globalThis.addEventListener("pagehide", () => this.stop(), { signal: end });
  }

  get isWorking() {
    return this.job.value?.state === "working";
  }

  /**
   * Begin a new job, and end the one under way.
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

  /** End the job under way; its findings stay. */
  stop() {
    this.#wanted.abort();
    const job = this.job.peek();
    if (job?.state !== "working") return;
    this.#until = 0;
    cancelJob(job.id);
    this.job.value = { ...job, state: "done" };
  }

  /** Ask whether the findings are still about the session's run. */
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
 * All that determines the runs with other seeds.
 *
 * @param {SessionPublic} session
 */
export function settingsOf({ branch, recipe, restarts, timeline }) {
  return JSON.stringify([branch, recipe.seed, recipe.tracker, restarts, timeline]);
}
