/** Several runs in step as one store: the runs of a comparison take the role of a session's branches. So the scrubber and the plots draw a
 * line for each, and all runs have one position.
 * Frames are the common ones, counted from 0, as the leading run counts its own. */

import { eventFramesOf } from "../session/readings.js";
import { HistoryWindow, Store } from "../session/store.js";
import { computed, effect, signal } from "../vendor/preact.js";

/** @import { SessionPublic } from "../shared/messages.js" */

/** @typedef {{name: string, colour: string, first: number}} Run `colour` is a CSS colour; `first` is its frame that is frame 0 here. */
/** @typedef {Run & {store: Store}} JointRun A run with the store of its session. */
/** @typedef {{beforeLoss: number|null, notes: {frame: number, note: string}[]}} Whole `beforeLoss` is shortly before any run's first loss. */

const BROKEN = /** @type {const} */ (["gone", "lost", "connecting"]);

export class JointStore extends Store {
  #runs;
  #lead;
  /** Index of the run whose bands, strips and changes are shown, and whose curves lie on top. */
  front = signal(0);
  /** Losses and notes of whole runs, once they are known. */
  whole = signal(/** @type {Whole} */ ({ beforeLoss: null, notes: [] }));

  /**
   * @param {readonly JointRun[]} runs
   * @param {number} lead Index of the run that all others follow; its frame 0 is frame 0 here.
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
      // The state is that of the worst connection.
      this.connection.value = BROKEN.find((each) => runs.some(({ store }) => store.connection.value === each)) ?? "open";
      // Nothing is shown before all runs are known.
      if (runs.every(({ store }) => store.session !== null)) this.session = this.#joined();
    });
  }

  // Lists stay the same objects while their content does, so that they trigger no drawing.

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

  /** The frames with an event in any run, in rising order. */
  get eventFrames() {
    const all = this.#runs.flatMap(({ store }, place) => eventFramesOf({ known: store.known, history: this.historyOf(String(place)) }));
    return [...new Set(all)].sort((one, other) => one - other);
  }

  /** The losses of each run. */
  get losses() {
    return this.#runs.map(({ colour }, place) => ({ colour, history: this.historyOf(String(place)) }));
  }

  /** @returns {SessionPublic} Position and playing are those of the leading run, everything else that of the run in front. */
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

/** Entries of one run with their frames counted in the common frames.
 *
 * @template {{frame: number}} Happened
 * @param {readonly Happened[]} all
 * @param {number} first Its frame that is the common frame 0.
 */
function shifted(all, first) {
  return all.map((each) => ({ ...each, frame: Math.max(0, each.frame - first) }));
}
