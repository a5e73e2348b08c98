/**
 * Why a session lost its target, and what would have saved it. The page asks both by itself when it sees a loss; the card over
 * the picture and the tab in the place of the plots show the answers.
 */

import { cancelJob, followJob, messageOf, request } from "../../shared/api.js";
import { follow, later } from "../../shared/timing.js";
import { isParticipant } from "../../shared/visitor.js";
import { batch, computed, effect, signal } from "../../vendor/preact.js";
import { steer } from "../steering.js";
import { isGone } from "../store.js";

/** @import { Value } from "../../shared/format.js" */
/** @import { Bands, Explanation, ExplorationCreate, ExplorationJob, Report, SessionPublic, ToldFinding } from "../../shared/messages.js" */
/** @import { Mounted } from "../mount.js" */
/** @import { Store } from "../store.js" */

// An exploration: work of the server beside a session. The page polls it for its findings, and ends it when it no longer needs
// them. Findings stay until there are newer ones; they are stale while the session's run is another one.

/** @typedef {{result: Report|Bands, branch: string, run: string}} Found What was found, and about which run. */

export class Exploration {
  /** The newest job. */
  job = signal(/** @type {ExplorationJob|null} */ (null));
  /** The newest findings of any job. */
  found = signal(/** @type {Found|null} */ (null));
  /** Why there are no findings, a sentence. */
  error = signal("");
  #store;
  #wanted = new AbortController();
  /** What was asked last, about which run; empty where that has failed or was stopped. */
  #asked = "";

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

  get isStale() {
    return this.found.value !== null && this.found.value.run !== settingsOf(this.#store.session);
  }

  /**
   * Begin a new job, and end the one under way; nothing happens where the same is known or under way.
   *
   * @param {ExplorationCreate} body
   */
  async begin(body) {
    const run = settingsOf(this.#store.session);
    const asked = JSON.stringify([run, body]);
    if (asked === this.#asked) return;
    this.stop();
    const wanted = (this.#wanted = new AbortController());
    this.#asked = asked;
    this.error.value = "";
    try {
      const begun = await request("POST sessions/{session}/explorations", { session: this.#store.known.id, body });
      if (wanted.signal.aborted) {
        cancelJob(begun.id);
        return;
      }
      this.#take(begun, run);
      await followJob(begun, (now) => now && this.#take(now, run), wanted.signal);
    } catch (error) {
      if (!wanted.signal.aborted) this.#fail(messageOf(error));
    }
  }

  /** End the job under way; its findings stay. */
  stop() {
    this.#wanted.abort();
    this.#asked = "";
    const job = this.job.peek();
    if (job?.state !== "working") return;
    cancelJob(job.id);
    this.job.value = { ...job, state: "done" };
  }

  /** @param {string} words */
  #fail(words) {
    this.error.value = words;
    this.#asked = "";
  }

  /**
   * @param {ExplorationJob} now
   * @param {string} run
   */
  #take(now, run) {
    batch(() => {
      this.job.value = now;
      if (now.result !== null) this.found.value = { result: now.result, branch: now.branch, run };
      if (now.state === "failed") this.#fail(now.error ?? "This could not be found out.");
    });
    // Changes to another branch can still be tried; changes to a run that was replaced cannot.
    if (now.branch === this.#store.known.branch && run !== settingsOf(this.#store.session)) this.stop();
  }
}

/**
 * All that determines the active branch's run, and runs with other seeds; empty until that is known.
 *
 * @param {SessionPublic|null} session
 */
export function settingsOf(session) {
  if (session === null) return "";
  const { branch, recipe, restarts, timeline } = session;
  return JSON.stringify([branch, recipe.seed, recipe.tracker, restarts, timeline]);
}

/** How long a loss may go on, and a dragged slider settle, before anything is asked. */
const SETTLE_MS = 300;

export class Loss {
  view;
  exploration;
  /** Why the target was lost, for the loss that was asked about last, and from where to watch it. */
  explanation = signal(/** @type {Explanation|null} */ (null));
  /** Why the server could not say why. */
  refusal = signal("");
  /** Whether a person put the card away or opened it; null until then: it is open while the run has a loss and no tab is open. */
  isAway = signal(/** @type {boolean|null} */ (null));
  /** @type {Record<string, Value>} Of the explored run. */
  parameters = {};
  #asked = new AbortController();
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
    const stop = effect(() => {
      if (losses.value === "") return undefined;
      return later(() => this.#chosen !== settingsOf(store.session) && this.ask(), SETTLE_MS, end);
    });
    const leave = () => {
      // Why belongs to one branch.
      if (view.card.value === "why") view.card.value = null;
    };
    follow(() => store.session?.branch, leave, end);
    // An answer that comes after the end begins nothing.
    for (const ending of [stop, () => this.#asked.abort()]) end.addEventListener("abort", ending);
  }

  /** Whether the active branch has lost its target anywhere. */
  isLost = computed(() => this.view.store.isAwake && this.view.store.knowsLoss);

  /** What would have saved the run, as far as that is known. */
  report = computed(() => {
    const result = this.exploration.found.value?.result ?? null;
    return result !== null && "findings" in result ? result : null;
  });

  /** The tab that replaces the plots. */
  get tab() {
    const { value: card } = this.view.card;
    return card === "inspect" ? null : card;
  }

  /** Whether changes can be tried: not by participants of a class, and not on a replay, which no change alters. */
  get offersChanges() {
    const { session } = this.view.store;
    return !isParticipant && session !== null && !session.trackers.some(({ id, replays }) => id === session.tracker && replays);
  }

  /** Show why, for the loss that the shown frame is in, else for the first that lasts. */
  open() {
    const { card, store } = this.view;
    if (!store.isSteerable) return; // a key may be pressed before there is a session
    card.value = "why";
    const { position } = store.known;
    this.ask(isGone(store.history.at(position)) ? position : undefined);
  }

  /** @param {number} [frame] The first lasting loss if not given. */
  async ask(frame) {
    if (!this.view.store.isSteerable) return;
    const { store } = this.view;
    this.#chosen = frame === undefined ? "" : settingsOf(store.session);
    this.#asked.abort();
    const { signal: now } = (this.#asked = new AbortController());
    try {
      const explanation = await request("GET sessions/{session}/explanation", { session: store.known.id, frame });
      if (now.aborted) return;
      this.explanation.value = explanation;
      this.refusal.value = "";
      if (!explanation.diagnosis.lost || !this.offersChanges) return;
      this.parameters = { ...store.known.parameters };
      await this.exploration.begin({ kind: "what-if", frame: explanation.diagnosis.frame });
    } catch (error) {
      if (!now.aborted) this.refusal.value = messageOf(error);
    }
  }

  /** Whether to offer another try: the last one failed, was stopped, or is about a run that has changed since. */
  get isCut() {
    const { error, isStale, isWorking } = this.exploration;
    return this.isLost.value && !isWorking && (error.value !== "" || isStale);
  }

  /** Whether a change can be opened as a branch: the run that it belongs to still exists. */
  get canTry() {
    const { branch: active, branches } = this.view.store.known;
    const { found: { value: found }, isStale } = this.exploration;
    return found !== null && (!isStale || (found.branch !== active && branches.some(({ id }) => id === found.branch)));
  }

  /**
   * Open a change as a branch beside the lost run, and go to the frame where it was judged.
   *
   * @param {ToldFinding} finding
   */
  async tryOut({ values, seed, title }) {
    const { store } = this.view;
    const [found, report] = [this.exploration.found.peek(), this.report.peek()];
    if (found === null || report === null) return;
    if (this.isAway.peek() === false) this.isAway.value = null;
    if (found.branch !== store.known.branch) await steer(store, { kind: "activate", branch: found.branch });
    const made = await steer(store, { kind: "branch", frame: report.begin, values, seed, title });
    if (made) await steer(store, { kind: "seek", frame: report.end });
  }
}
