/** Why a session lost its target, and what-if. The page requests both automatically after a loss; the card over the picture and the tab in
 place of the plots show the answers. */

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

// An exploration: background work of the server for a session. The page polls its findings, and ends it when they are no longer needed.
// Findings stay until there are newer ones; they are stale if the session's run has changed.

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
  /** The last request and its run; empty if it failed or was stopped. */
  #asked = "";

  /**
   * @param {Store} store Store of the session.
   * @param {AbortSignal} end Ends the exploration.
   */
  constructor(store, end) {
    this.#store = store;
    end.addEventListener("abort", () => this.stop());
    // A page that was left ignores answers.
    globalThis.addEventListener("pagehide", () => this.stop(), { signal: end });
  }

  get isWorking() {
    return this.job.value?.state === "working";
  }

  get isStale() {
    return this.found.value !== null && this.found.value.run !== settingsOf(this.#store.session);
  }

  /** Begin a new job, and end the running one; do nothing if the same is known or running.
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
      const { id, branch } = this.#store.known;
      const begun = await request("POST sessions/{session}/explorations", { session: id, body });
      // A command may have made another branch active on the way.
      if (begun.branch !== branch && !wanted.signal.aborted) this.stop();
      if (wanted.signal.aborted) cancelJob(begun.id);
      else {
        this.#take(begun, run);
        await followJob(begun, (now) => now && this.#take(now, run), wanted.signal);
      }
    } catch (error) {
      if (!wanted.signal.aborted) this.#fail(messageOf(error));
    }
  }

  /** End the running job; its findings stay. */
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
      if (now.state === "failed") this.#fail(now.error ?? "The exploration failed.");
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

/** Delays before a request: for a loss to last, and for a dragged slider to settle. */
const SETTLE_MS = 300;

export class Loss {
  view;
  exploration;
  /** The explanation of the last requested loss, and the frame from which to watch it. */
  explanation = signal(/** @type {Explanation|null} */ (null));
  /** Why the server could not explain the loss. */
  refusal = signal("");
  /** Whether a person closed or opened the card; null until then: it is open while the run has a loss and no tab is open. */
  isAway = signal(/** @type {boolean|null} */ (null));
  /** @type {Record<string, Value>} Of the explored run. */
  parameters = {};
  #asked = new AbortController();
  /** The run whose loss a person chose; the page then requests no other loss by itself. */
  #chosen = "";

  /** @param {Mounted} view */
  constructor(view) {
    this.view = view;
    const { store, signal: end } = view;
    this.exploration = new Exploration(store, end);
    // When a loss begins or ends, the first lasting one may change.
    const losses = computed(() => {
      const { history } = store;
      return this.isLost.value ? `${store.known.branch} ${history.spans(isGone).length} ${isGone(history.at(history.length - 1))}` : "";
    });
    const stop = effect(() => {
      if (losses.value === "") return undefined;
      return later(() => this.#chosen !== settingsOf(store.session) && this.ask(), SETTLE_MS, end);
    });
    const leave = () => {
      // The explanation belongs to one branch.
      if (view.card.value === "why") view.card.value = null;
    };
    follow(() => store.session?.branch, leave, end);
    // An answer after the end starts nothing.
    for (const ending of [stop, () => this.#asked.abort()]) end.addEventListener("abort", ending);
  }

  /** Whether the active branch has any loss. */
  isLost = computed(() => this.view.store.isAwake && this.view.store.knowsLoss);

  /** The what-if findings so far. */
  report = computed(() => {
    const result = this.exploration.found.value?.result ?? null;
    return result !== null && "findings" in result ? result : null;
  });

  /** The tab that replaces the plots. */
  get tab() {
    const { value: card } = this.view.card;
    return card === "inspect" ? null : card;
  }

  /** Whether changes can be tried: not by participants of a class, and not on a replay, which they do not affect. */
  get offersChanges() {
    const { session } = this.view.store;
    return !isParticipant && session !== null && !session.trackers.some(({ id, replays }) => id === session.tracker && replays);
  }

  /** Explain the loss of the shown frame, or else the first lasting one. */
  open() {
    const { card, store } = this.view;
    if (!store.isSteerable) return; // a key may be pressed before there is a session
    card.value = "why";
    const { position } = store.known;
    this.ask(isGone(store.history.at(position)) ? position : undefined);
  }

  /** @param {number} [frame] By default the first lasting loss. */
  async ask(frame) {
    if (!this.view.store.isSteerable) return;
    const { store } = this.view;
    this.#chosen = frame === undefined ? "" : settingsOf(store.session);
    this.#asked.abort();
    const { signal: now } = (this.#asked = new AbortController());
    const { branch } = store.known;
    const isOver = () => now.aborted || branch !== store.known.branch;
    try {
      const explanation = await request("GET sessions/{session}/explanation", { session: store.known.id, frame, branch });
      if (isOver() || explanation === null) return;
      this.explanation.value = explanation;
      this.refusal.value = "";
      if (!explanation.diagnosis.lost || !this.offersChanges) return;
      this.parameters = { ...store.known.parameters };
      await this.exploration.begin({ kind: "what-if", frame: explanation.diagnosis.frame });
    } catch (error) {
      if (!isOver()) this.refusal.value = messageOf(error);
    }
  }

  /** Whether to offer another attempt: the last one failed, was stopped, or is about a changed run. */
  get isCut() {
    const { error, isStale, isWorking } = this.exploration;
    return this.isLost.value && !isWorking && (error.value !== "" || isStale);
  }

  /** Whether a change can be opened as a branch: its run still exists. */
  get canTry() {
    const { branch: active, branches } = this.view.store.known;
    const { found: { value: found }, isStale } = this.exploration;
    return found !== null && (!isStale || (found.branch !== active && branches.some(({ id }) => id === found.branch)));
  }

  /** Open a change as a branch of the lost run, and go to the frame where it was judged.
   *
   * @param {ToldFinding} finding
   */
  async tryOut({ values, seed, title }) {
    const { store } = this.view;
    const [found, report] = [this.exploration.found.peek(), this.report.peek()];
    if (found === null || report === null) return;
    // The card closes.
    /** @type {HTMLElement|null|undefined} */ (this.view.scene?.root.closest(".session-view")?.querySelector(".play"))?.focus({ preventScroll: true });
    if (this.isAway.peek() === false) this.isAway.value = null;
    await steer(store, { kind: "activate", branch: found.branch });
    const made = await steer(store, { kind: "branch", frame: report.begin, values, seed, title });
    if (made) await steer(store, { kind: "seek", frame: report.end });
  }
}
