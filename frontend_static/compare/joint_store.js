/**
 * Several runs in step as one store: what a session has as branches, a comparison has as runs. So the scrubber and the plots
 * draw a line for each, and all runs have one position.
 *
 * Frames are those that all runs have in common, counted from 0 on, as the run that leads counts its own.
 */

import { eventFramesOf } from "../session/readings.js";
import { HistoryWindow, Store } from "../session/store.js";
import { computed, effect, signal } from "../vendor/preact.js";

/** @import { SessionPublic } from "../shared/messages.js" */

/** @typedef {{name: string, colour: string, first: number}} Run `colour` as CSS has it; `first` is its frame that is frame 0 here. */
/** @typedef {Run & {store: Store}} JointRun With what is known of its session. */
/** @typedef {{beforeLoss: number|null, notes: {frame: number, note: string}[]}} Whole `beforeLoss` is shortly before any run's first loss. */

const BROKEN = /** @type {const} */ (["gone", "lost", "connecting"]);

export class JointStore extends Store {
  #runs;
  #lead;
  /** Place of the run whose bands, strips and changes are shown, and whose curves lie above. */
  front = signal(0);
  /** Losses and notes of whole runs, once they are known. */
  whole = signal(/** @type {Whole} */ ({ beforeLoss: null, notes: [] }));

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
      this.histories.set(String(place), new HistoryWindow(() => store.history, first));
    });
    effect(() => {
      // The worst connection counts.
      this.connection.value = BROKEN.find((each) => runs.some(({ store }) => store.connection.value === each)) ?? "open";
      // There is nothing to show of all before all are there.
      if (runs.every(({ store }) => store.session !== null)) this.session = this.#joined();
    });
  }

  // Lists stay the same as long as what they are made of does, so that nothing is drawn for them.

  #branches = computed(() => this.#runs.map(({ name, colour, store }, place) =>
    ({ id: String(place), title: name, parent: null, frame: 0, tracker: store.session?.tracker ?? "", colour })));
  #bookmarks = computed(() => this.whole.value.notes.map((note, place) => ({ id: String(place), branch: "", ...note })));
  #timeline = computed(() => shifted(this.#shown.store.known.timeline, this.#shown.first));
  #thresholds = computed(() => {
    const { store, first } = this.#shown;
    return store.known.thresholds.map((limit) => ({ ...limit, steps: shifted(limit.steps, first) }));
  });

  /** The run in front. */
  get #shown() {
    return this.#runs[this.front.value];
  }

  get beforeLoss() {
    return this.whole.value.beforeLoss;
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

  /** @returns {SessionPublic} What moves is that of the run which leads, all else that of the run in front. */
  #joined() {
    const lengths = this.#runs.map((_, place) => this.historyOf(String(place)).length);
    const { id, position, frames, goal, playing, speed, speeds, state, message, recipe } = this.#runs[this.#lead].store.known;
    return {
      ...this.#shown.store.known,
      ...{ id, position, frames, goal, playing, speed, speeds, state, message, recipe },
      computed: Math.max(0, Math.min(...lengths) - 1),
      branch: String(this.front.value),
      branches: this.#branches.value,
      bookmarks: this.#bookmarks.value,
      timeline: this.#timeline.value,
      thresholds: this.#thresholds.value,
    };
  }
}

/**
 * What happened in frames of one run, in the frames of all.
 *
 * @template {{frame: number}} Happened
 * @param {readonly Happened[]} all
 * @param {number} first Its frame that is frame 0 of all.
 */
function shifted(all, first) {
  return all.map((each) => ({ ...each, frame: Math.max(0, each.frame - first) }));
}
