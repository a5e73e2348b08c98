/**
 * A comparison as a component: runs in step in any element of a page, beside what differs between them, and none of it
 * left when it is taken away again. Whoever follows a class has the same of sessions that are another's, to be looked at.
 */

import { fill, h } from "../shared/dom.js";
import { begin, follow } from "./comparison_request.js";
import { column } from "./column.js";
import { Table } from "./table.js";
import { JointView } from "./joint_view.js";

/** @import { ViewKind } from "../session/view_choice.js" */
/** @import { ComparedPublic, ComparedRun, ComparisonJob, ComparisonResult, FileKind, Recipe, RunComparisonPublic } from "../shared/messages.js" */
/** @import { Column } from "./column.js" */
/** @import { Arrangement, Wanted } from "../shared/comparison_link.js" */
/** @import { Member } from "./joint_view.js" */

/**
 * What others need to show the same sessions, as a lecturer's page tells a class; what makes the runs is none of it, which
 * may be long.
 *
 * @typedef {object} Told
 * @property {Outline} outline
 * @property {Outcome|null} outcome What came of the runs, as far as it is known.
 * @property {Arrangement} arrangement
 */

/** @typedef {Pick<ComparedPublic, "name"|"title"|"colour"|"first">} Run */
/** @typedef {Pick<RunComparisonPublic, "unit"|"settings"> & {runs: (Run & {recipe?: Recipe})[], exports?: FileKind[]}} Outline */
/** @typedef {Pick<ComparisonJob, "state"|"done"|"total"|"error"> & {result: ComparisonResult|null}} Outcome */

/**
 * @typedef {object} Options
 * @property {ViewKind} [view] How the runs are seen; flat if not given.
 * @property {Partial<import("../session/keys.js").Actions>} [actions] What keys do beyond moving through the runs.
 * @property {(compared: RunComparison) => void} [onChange] Called when its link, or what is told of it, has changed.
 * @property {(runs: ComparedRun[]) => void} [onFewer] Called with the runs that stay when one is taken away.
 */

/**
 * Compare runs: sessions are made for them, which end with the comparison.
 *
 * @param {HTMLElement} element
 * @param {Wanted} wanted
 * @param {(sentence: string) => void} tell What to say while it has to be waited for; empty when there is nothing to wait for.
 * @param {AbortSignal} signal
 * @param {Options} [options]
 * @returns {Promise<RunComparison>} Rejects where the runs cannot be compared.
 */
export async function compare(element, { runs, position = 0, arrangement = "side" }, tell, signal, options = {}) {
  const job = await begin(runs, tell, signal);
  const comparison = job.result;
  if (comparison === null) throw new Error(job.error ?? "The runs could not be compared");
  const known = comparison.runs.map(({ recipe }) => ({ recipe }));
  const at = Math.min(position, comparison.frames - 1);
  const members = comparison.runs.map(({ shown, upload, first }) => ({ recipe: { recipe: shown, upload, position: first + at } }));
  const compared = new RunComparison(element, comparison, members, { ...options, arrangement, readOnly: false });
  follow(job, known, (now) => compared.know({ ...now, result: now.result?.found ?? null }), compared.signal).catch((error) => compared.fail(error));
  return compared;
}

/**
 * Look at a comparison that somebody else moves.
 *
 * @param {HTMLElement} element
 * @param {Told} told
 * @param {readonly string[]} sessions
 * @param {Options} [options]
 */
export function watch(element, { outline, outcome, arrangement }, sessions, options = {}) {
  const compared = new RunComparison(element, outline, sessions.map((session) => ({ session })), { ...options, arrangement, readOnly: true });
  if (outcome !== null) compared.know(outcome);
  return compared;
}

export class RunComparison {
  #outline;
  /** @type {Outcome|null} */
  #outcome = null;
  /** @type {Arrangement} */
  #arrangement = "side";
  /** @type {JointView} */
  #together;
  /** @type {Column[]} */
  #columns;
  #table;
  #root;
  #options;
  #difference;

  /**
   * @param {HTMLElement} element
   * @param {Outline} outline
   * @param {readonly Pick<Member, "recipe"|"session">[]} sessions
   * @param {Options & {arrangement: Arrangement, readOnly: boolean}} options
   */
  constructor(element, outline, sessions, options) {
    this.#outline = outline;
    this.#options = options;
    const { runs } = outline;
    const isRemovable = runs.length > 2 && options.onFewer !== undefined;
    this.#columns = runs.map((run, place) =>
      column(run, place, {
        choose: () => this.#choose(place),
        remove: isRemovable ? () => this.#without(place) : null,
        position: () => this.position,
      }),
    );
    this.#table = new Table(outline);
    const [deck, plots] = [h("div", { class: "comparison-deck" }), h("div", { class: "plots" })];
    const views = h("div", { class: "comparison-views" }, this.#columns.map((each) => each.element));
    const side = h("aside", { class: "comparison-side", "aria-label": "What differs" }, this.#table.element, plots);
    this.#root = h("div", { class: "comparison", data: { runs: runs.length } }, views, side, deck);
    this.#root.style.setProperty("--runs", String(runs.length));
    fill(element, this.#root);
    const members = runs.map(({ name, colour, first }, place) => ({ name, colour, first, place: this.#columns[place].place, ...sessions[place] }));
    this.#together = new JointView(members, { view: options.view, readOnly: options.readOnly });
    this.#difference = h("button", { type: "button", disabled: true, on: { click: () => this.toDifference() } }, "First difference");
    this.#together.deck(deck, [this.#difference]);
    this.#together.plotInto(plots);
    if (!options.readOnly) this.#together.listen({ ...options.actions, difference: () => this.toDifference() });
    const { store } = this.#together;
    store.on(["session"], () => this.#outcome && this.#table.show(this.#outcome, this.#together.measure));
    this.arrange(options.arrangement);
    this.#choose(0);
    /** Resolves with the ids of the sessions when all of them are there, or rejects. */
    this.begun = this.#together.begun;
  }

  get signal() {
    return this.#together.signal;
  }

  /** The frame that is shown, of those that all runs have. */
  get position() {
    return this.#together.store.session?.position ?? 0;
  }

  /** Files that can be made of it, where that is known. */
  get exports() {
    return this.#outline.exports ?? [];
  }

  /** What makes the same comparison elsewhere. @returns {Wanted} */
  get wanted() {
    return { runs: this.#runs(), position: this.position, arrangement: this.#arrangement };
  }

  /** Each run's session as it is mounted. */
  get views() {
    return this.#together.views;
  }

  /** What others need to show the same sessions. @returns {Told} */
  get told() {
    const { unit, settings, runs } = this.#outline;
    const named = runs.map(({ name, title, colour, first }) => ({ name, title, colour, first }));
    return { outline: { unit, settings, runs: named }, outcome: this.#outcome, arrangement: this.#arrangement };
  }

  get title() {
    return this.#outline.runs.map(({ name }) => name).join(" · ");
  }

  /** @param {Outcome} outcome What is known by now of what came of the runs. */
  know({ state, done, total, result, error }) {
    const isNew = this.#outcome?.state !== state;
    const outcome = (this.#outcome = { state, done, total, result, error });
    const { store } = this.#together;
    this.#table.show(outcome, this.#together.measure);
    if (result !== null && isNew) {
      const { first_difference: difference, before_loss: beforeLoss } = result;
      this.#difference.disabled = difference === null;
      this.#difference.title = difference === null ? "The runs are identical" : `Go to frame ${difference}, the first in which two runs differ (D)`;
      this.#difference.textContent = difference === null ? "No difference" : `First difference ${difference}`;
      store.know({ beforeLoss, notes: difference === null ? [] : [{ frame: difference, note: "The first frame in which two runs differ" }] });
    }
    if (isNew) this.#options.onChange?.(this);
  }

  /** @param {unknown} error Why it is not known what came of the runs. */
  fail(error) {
    if (this.signal.aborted) return;
    const why = error instanceof Error ? error.message : String(error);
    this.know({ state: "failed", done: 0, total: 0, result: null, error: why });
  }

  /** Go to the first frame in which two runs differ. */
  toDifference() {
    const frame = this.#outcome?.result?.first_difference ?? null;
    if (frame !== null) this.#together.steering.seek(frame);
  }

  /** @param {Arrangement} arrangement */
  arrange(arrangement) {
    this.#arrangement = arrangement;
    this.#root.dataset.arrangement = arrangement;
    if (arrangement === "over") this.#together.show("flat");
    this.#together.overlays.forEach((overlay, place) => {
      overlay.wear(arrangement === "over" ? { tint: rgb(this.#outline.runs[place].colour), isLowest: place === 0 } : null);
    });
    this.#options.onChange?.(this);
  }

  /** @param {ViewKind} kind */
  show(kind) {
    if (kind === "scene") this.arrange("side");
    this.#together.show(kind);
  }

  /** End it with the sessions that were made for it. */
  end() {
    this.#together.end();
    this.#root.remove();
  }

  /** @param {number} place */
  #choose(place) {
    this.#together.store.bringToFront(place);
    this.#columns.forEach(({ setFront }, other) => setFront(other === place));
  }

  /** @param {number} place */
  #without(place) {
    this.#options.onFewer?.(this.#runs().filter((_, other) => other !== place));
  }

  /** What makes the runs, where that is known. */
  #runs() {
    return this.#outline.runs.map(({ recipe }) => ({ recipe }));
  }
}

/**
 * @param {string} colour "#rrggbb"
 * @returns {[number, number, number]}
 */
function rgb(colour) {
  const value = Number.parseInt(colour.slice(1), 16);
  return [value >> 16, (value >> 8) & 255, value & 255];
}
