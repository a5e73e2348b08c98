/**
 * What is asked of a session's loss: why the target was lost, and what would have saved it. Both begin by themselves when a
 * loss is seen. The card over the picture and the tab beside it show them.
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

/** A loss is let go on for a moment, and a slider that is dragged settles. */
const SETTLE_MS = 300;

export class Loss {
  view;
  exploration;
  /** Why the target was lost, of the loss that was asked about last. */
  diagnosis = signal(/** @type {Diagnosis|null} */ (null));
  /** Why the server could not say why. */
  refusal = signal("");
  /** What is shown in the place of the plots. */
  tab = signal(/** @type {"why"|"what-if"|null} */ (null));
  /** Whether a person has put the card away, or fetched it; else it is there while the target is lost and no tab is open. */
  isAway = signal(/** @type {boolean|null} */ (null));
  /** @type {Record<string, Value>} Those of the run that is explored. */
  parameters = {};
  #asked = new AbortController();
  /** @type {number|null} The loss that is explored. */
  #frame = null;

  /** @param {Mounted} view */
  constructor(view) {
    this.view = view;
    const { store, signal: end } = view;
    this.exploration = new Exploration(store, end);
    const run = computed(() => (store.session === null ? "" : settingsOf(store.session)));
    const lost = computed(() => (this.isLost.value ? store.known.branch : ""));
    const endings = [
      effect(() => (lost.value === "" ? undefined : later(() => this.ask(), SETTLE_MS, end))),
      effect(() => (run.value === "" ? undefined : later(() => this.exploration.look(), SETTLE_MS, end))),
      // Why belongs to one branch.
      effect(() => {
        if (store.session?.branch !== undefined && this.tab.peek() === "why") this.tab.value = null;
      }),
      // An answer that comes after the end begins nothing.
      () => this.#asked.abort(),
    ];
    for (const ending of endings) end.addEventListener("abort", ending);
  }

  /** Whether the active branch has lost its target anywhere. */
  isLost = computed(() => this.view.store.isAwake && this.view.store.knowsLoss);

  /** What would have saved the run, as far as that is known. */
  report = computed(() => {
    const result = this.exploration.job.value?.result ?? null;
    return result !== null && "findings" in result ? /** @type {Report} */ (result) : null;
  });

  /** Whether changes can be tried here: in a class nobody may, and what was computed elsewhere is the same whatever one changes. */
  get offersChanges() {
    const { session } = this.view.store;
    return !isParticipant && session !== null && !session.trackers.some(({ id, replays }) => id === session.tracker && replays);
  }

  /** Ask about the loss in which the frame is that is shown, else about the first one that lasts; and show why. */
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

  /** Whether changes may be tried once more, since that has ended early or was about another run. */
  get isCut() {
    const { error, isWorking, job } = this.exploration;
    return this.isLost.value && !isWorking && (error.value !== "" || job.value?.stale === true);
  }

  /** Whether a change can be opened: its run is there, as itself or as another branch. */
  get canTry() {
    const { known } = this.view.store;
    const job = this.exploration.job.value;
    return job !== null && (!job.stale || (job.branch !== known.branch && known.branches.some(({ id }) => id === job.branch)));
  }

  /**
   * Open a change as a branch beside the lost run, and let it go on to where it was judged.
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
