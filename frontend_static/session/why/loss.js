/**
 * Why a session lost its target, and what would have saved it. The page asks both by itself when it sees a loss; the card over
 * the picture and the tab in the place of the plots show the answers.
 */

import { cancelJob, followJob, jobOf, messageOf, request, sendCommand } from "../../shared/api.js";
import { attempt } from "../../shared/dom.js";
import { later } from "../../shared/timing.js";
import { isParticipant } from "../../shared/visitor.js";
import { batch, computed, effect, signal } from "../../vendor/preact.js";
import { isGone } from "../store.js";

/** @import { Value } from "../../shared/format.js" */
/** @import { Diagnosis, ExplorationCreate, ExplorationJob, Report, SessionPublic, ToldFinding } from "../../shared/messages.js" */
/** @import { Mounted } from "../mount.js" */
/** @import { Store } from "../store.js" */

// An exploration: work of the server beside a session. The page polls it for its findings, and ends it when it no longer needs
// them. Findings stay until there are newer ones; they are stale once the session's run has changed.

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
      const begun = await request("POST sessions/{session}/explorations", { session: this.#store.known.id, body });
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

/** How long a loss may go on, and a dragged slider settle, before anything is asked. */
const SETTLE_MS = 300;

export class Loss {
  view;
  exploration;
  /** Why the target was lost, for the loss that was asked about last. */
  diagnosis = signal(/** @type {Diagnosis|null} */ (null));
  /** The frame from which to watch that loss. */
  before = signal(/** @type {number|null} */ (null));
  /** Why the server could not say why. */
  refusal = signal("");
  /** What is shown in the place of the plots. */
  tab = signal(/** @type {"why"|"what-if"|null} */ (null));
  /** Whether a person put the card away or opened it; null until then: it is open while the run has a loss and no tab is open. */
  isAway = signal(/** @type {boolean|null} */ (null));
  /** @type {Record<string, Value>} Of the explored run. */
  parameters = {};
  #asked = new AbortController();
  /** @type {number|null} First frame of the explored loss. */
  #frame = null;
  /** The run with a loss that a person chose to ask about; the page then asks about no other one by itself. */
  #chosen = "";

  /** @param {Mounted} view */
  constructor(view) {
    this.view = view;
    const { store, signal: end } = view;
    this.exploration = new Exploration(store, end);
    // As a loss begins or ends, another one may be the first that lasts.
    const losses = computed(() => {
      const { history } = store;
      return this.isLost.value ? `${store.known.branch} ${history.spans(isGone).length} ${isGone(history.at(history.length - 1))}` : "";
    });
    const endings = [
      effect(() => (losses.value === "" ? undefined : later(() => this.#chosen !== this.#run.value && this.ask(), SETTLE_MS, end))),
      effect(() => (this.#run.value === "" ? undefined : later(() => this.exploration.look(), SETTLE_MS, end))),
      // Why belongs to one branch.
      effect(() => {
        if (store.session?.branch !== undefined && this.tab.peek() === "why") this.tab.value = null;
      }),
      // An answer that comes after the end begins nothing.
      () => this.#asked.abort(),
    ];
    for (const ending of endings) end.addEventListener("abort", ending);
  }

  #run = computed(() => (this.view.store.session === null ? "" : settingsOf(this.view.store.session)));

  /** Whether the active branch has lost its target anywhere. */
  isLost = computed(() => this.view.store.isAwake && this.view.store.knowsLoss);

  /** What would have saved the run, as far as that is known. */
  report = computed(() => {
    const result = this.exploration.job.value?.result ?? null;
    return result !== null && "findings" in result ? /** @type {Report} */ (result) : null;
  });

  /** Whether changes can be tried: not by participants of a class, and not on a replay, which no change alters. */
  get offersChanges() {
    const { session } = this.view.store;
    return !isParticipant && session !== null && !session.trackers.some(({ id, replays }) => id === session.tracker && replays);
  }

  /** Show why, for the loss that the shown frame is in, else for the first that lasts. */
  open() {
    const { able, store } = this.view;
    if (!able) return; // a key may be pressed before there is a session
    this.tab.value = "why";
    const { position } = store.known;
    this.ask(isGone(store.history.at(position)) ? position : undefined);
  }

  /** @param {number} [frame] The first lasting loss if not given. */
  async ask(frame) {
    if (!this.view.able) return;
    this.#chosen = frame === undefined ? "" : this.#run.value;
    this.#asked.abort();
    const { signal: now } = (this.#asked = new AbortController());
    try {
      const { diagnosis, before } = await request("GET sessions/{session}/explanation", { session: this.view.store.known.id, frame });
      if (now.aborted) return;
      batch(() => {
        this.diagnosis.value = diagnosis;
        this.before.value = before;
        this.refusal.value = "";
      });
      if (diagnosis.lost && this.offersChanges) await this.#explore(diagnosis.frame, now);
    } catch (error) {
      if (!now.aborted) this.refusal.value = messageOf(error);
    }
  }

  /**
   * Try what would have saved the run, unless that is known or under way.
   *
   * @param {number|null} frame
   * @param {AbortSignal} now
   */
  async #explore(frame, now) {
    await this.exploration.look();
    const job = this.exploration.job.peek();
    if (now.aborted || (job !== null && !job.stale && frame === this.#frame)) return;
    this.#frame = frame;
    this.parameters = { ...this.view.store.known.parameters };
    await this.exploration.begin({ kind: "what-if", frame });
  }

  /** Whether to offer another try: the last one failed, was stopped, or is about a run that has changed since. */
  get isCut() {
    const { error, isWorking, job } = this.exploration;
    return this.isLost.value && !isWorking && (error.value !== "" || job.value?.stale === true);
  }

  /** Whether a change can be opened as a branch: the run that it belongs to still exists. */
  get canTry() {
    const { known } = this.view.store;
    const job = this.exploration.job.value;
    return job !== null && (!job.stale || (job.branch !== known.branch && known.branches.some(({ id }) => id === job.branch)));
  }

  /**
   * Open a change as a branch beside the lost run, and go to the frame where it was judged.
   *
   * @param {ToldFinding} finding
   */
  async tryOut({ values, seed, title }) {
    const { store, commands } = this.view;
    const [job, report] = [this.exploration.job.peek(), this.report.peek()];
    if (job === null || report === null) return;
    if (this.isAway.peek() === false) this.isAway.value = null;
    if (job.branch !== store.known.branch) await commands.activate(job.branch);
    const made = await commands.branch({ frame: report.begin, values, seed, title });
    if (made) await attempt(() => sendCommand(store.known.id, { kind: "seek", frame: report.end }));
  }
}
