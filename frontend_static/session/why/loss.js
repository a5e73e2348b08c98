/**
 * Why a session lost its target, and what would have saved it. The page asks both by itself when it sees a loss; the card over
 * the picture and the tab in the place of the plots show the answers.
 */

import { api, messageOf } from "../../shared/api.js";
import { isParticipant } from "../../shared/participant.js";
import { later } from "../../shared/timing.js";
import { attempt } from "../../shared/toast.js";
import { batch, computed, effect, signal } from "../../vendor/preact.js";
import { isGone } from "../history.js";
import { Exploration, settingsOf } from "./exploration.js";

/** @import { Diagnosis, Report, ToldFinding } from "../../shared/messages.js" */
/** @import { Value } from "../../shared/format.js" */
/** @import { Mounted } from "../mount.js" */

/** How long a loss may go on, and a dragged slider settle, before anything is asked. */
const SETTLE_MS = 300;

export class Loss {
  view;
  exploration;
  /** Why the target was lost, for the loss that was asked about last. */
  diagnosis = signal(/** @type {Diagnosis|null} */ (null));
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
      const { diagnosis } = await api.explanation(this.view.store.known.id, frame);
      if (now.aborted) return;
      batch(() => {
        this.diagnosis.value = diagnosis;
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
    if (made) await attempt(() => api.command(store.known.id, { kind: "seek", frame: report.end }));
  }
}
