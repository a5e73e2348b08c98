/**
 * Several runs in step as one store: what a session has as branches, a comparison has as runs. So the scrubber and the plots
 * draw a line for each, and all runs have one position.
 *
 * Frames are those that all runs have in common, counted from 0 on, as the run that leads counts its own.
 */

import { HistoryWindow } from "../session/history_window.js";
import { eventFramesOf } from "../session/series.js";
import { Steering } from "../session/steering.js";
import { Store } from "../session/store.js";

/** @import { BranchPublic, SessionPublic } from "../shared/messages.js" */

/** @typedef {{name: string, colour: string, first: number}} Run `colour` as CSS has it; `first` is its frame that is frame 0 here. */
/** @typedef {Run & {store: Store}} JointRun With what is known of its session. */

export class JointStore extends Store {
  #runs;
  #lead;
  #front = 0;
  /** @type {{frame: number, note: string}[]} Frames worth finding again. */
  #notes = [];
  /** @type {number|null} From where to watch the first loss of any run, where there is one. */
  beforeLoss = null;

  /**
   * @param {readonly JointRun[]} runs
   * @param {number} lead Place of the run that all others follow; its frame 0 is frame 0 here.
   * @param {boolean} readOnly
   */
  constructor(runs, lead, readOnly) {
    super({ readOnly });
    this.#runs = runs;
    this.#lead = lead;
    runs.forEach(({ store, first }, place) => {
      this.histories.set(String(place), new HistoryWindow(() => store.history, first, () => this.#frames));
      store.onAll((topics) => this.#heard(...topics));
    });
    this.#heard("session", "connection");
  }

  /** How many frames all runs have. */
  get #frames() {
    return Math.min(...this.#runs.map(({ store, first }) => (store.session?.frames ?? 0) - first));
  }

  /** @param {number} place Of the run whose bands, strips and changes are shown, and whose curves lie above. */
  bringToFront(place) {
    this.#front = place;
    this.#heard("session", "branch", "branches", "history", "timeline");
  }

  /**
   * Take note of the losses and notes of whole runs.
   *
   * @param {JointStore["beforeLoss"]} beforeLoss
   * @param {{frame: number, note: string}[]} notes
   */
  know(beforeLoss, notes) {
    this.beforeLoss = beforeLoss;
    this.#notes = notes;
    this.#heard("session", "bookmarks", "history");
  }

  get knowsLoss() {
    return this.beforeLoss !== null;
  }

  /** The frames in which something happens in any run, in rising order. */
  get eventFrames() {
    const all = this.#runs.flatMap(({ store }, place) => eventFramesOf({ known: store.known, history: this.historyOf(String(place)) }));
    return [...new Set(all)].sort((one, other) => one - other);
  }

  /** Where the target is lost in each run. */
  get losses() {
    return this.#runs.map(({ colour }, place) => ({ colour, history: this.historyOf(String(place)) }));
  }

  /** @param {...import("../session/store.js").Topic} topics */
  #heard(...topics) {
    this.connection = worst(this.#runs.map(({ store }) => store.connection));
    // There is nothing to show of all before all are there.
    if (this.#runs.some(({ store }) => store.session === null)) return;
    const [lead, front] = [this.#runs[this.#lead], this.#runs[this.#front]];
    this.session = this.#joined(lead.store.known, front.store.known, front.first);
    this.tell(...topics);
  }

  /**
   * @param {SessionPublic} lead Has the position and all that moves.
   * @param {SessionPublic} front Has what is shown of one run alone.
   * @param {number} first
   * @returns {SessionPublic}
   */
  #joined(lead, front, first) {
    const lengths = this.#runs.map((_, place) => this.historyOf(String(place)).length);
    const frames = this.#frames;
    const { id, position, goal, playing, speed, speeds, state, message, recipe } = lead;
    return {
      ...front,
      ...{ id, goal, playing, speed, speeds, state, message, recipe },
      position: Math.min(position, frames - 1),
      frames,
      computed: Math.max(0, Math.min(...lengths) - 1),
      branch: String(this.#front),
      branches: this.#runs.map(branchOf),
      bookmarks: this.#notes.map((note, place) => ({ id: String(place), branch: "", ...note })),
      timeline: front.timeline.map((change) => ({ ...change, frame: Math.max(0, change.frame - first) })),
      thresholds: front.thresholds.map((limit) => ({
        ...limit,
        steps: limit.steps.map((step) => ({ ...step, frame: Math.max(0, step.frame - first) })),
      })),
    };
  }
}

/**
 * @param {JointRun} run
 * @param {number} place
 * @returns {BranchPublic}
 */
function branchOf({ name, colour, store }, place) {
  return { id: String(place), title: name, parent: null, frame: 0, tracker: store.session?.tracker ?? "", colour };
}

/** @param {Store["connection"][]} all */
function worst(all) {
  const order = /** @type {const} */ (["gone", "lost", "connecting"]);
  return order.find((each) => all.includes(each)) ?? "open";
}

/** Moving through the runs: the one that leads is moved, and the others follow it. */
export class JointSteering extends Steering {
  #joint;

  /**
   * @param {Store} lead
   * @param {JointStore} joint
   * @param {AbortSignal} signal
   */
  constructor(lead, joint, signal) {
    super(lead, signal);
    this.#joint = joint;
  }

  eventFrames() {
    return this.#joint.eventFrames;
  }

  /** Go to before the first loss of any run, also where it has not been computed here yet. */
  async beforeLoss() {
    if (this.#joint.beforeLoss !== null) await this.seek(this.#joint.beforeLoss);
  }
}
