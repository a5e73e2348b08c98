/**
 * A comparison as a component: runs in step, with their differences and results. A follower of a class sees the lecturer's
 * sessions in the same component, read-only.
 */

import { cancelJob, followJob, messageOf, request } from "../shared/api.js";
import { whenCompiled } from "../shared/compiling.js";
import { IconButton } from "../shared/dom.js";
import { Made } from "../shared/page.js";
import { linkTo } from "../shared/share_link.js";
import { h, html, signal, untracked } from "../vendor/preact.js";
import { JointView } from "./joint.js";
import { Table } from "./table.js";

/** @import { ViewKind } from "../session/scene.js" */
/** @import { Arrangement, Wanted } from "../shared/comparison.js" */
/** @import { ComparedPublic, ComparedRun, ComparisonJob, ComparisonResult, FileKind, Recipe, RunComparisonPublic } from "../shared/messages.js" */
/** @import { Child } from "../vendor/preact.js" */
/** @import { Member } from "./joint.js" */

/** The data that followers need to show the same sessions. It leaves out the recipes, which may be long.
 *
 * @typedef {object} Told
 * @property {Outline} outline
 * @property {Outcome|null} outcome The results of the runs, once they are known.
 * @property {Arrangement} arrangement
 */

/** @typedef {Pick<ComparedPublic, "name"|"title"|"colour"|"first">} Run */
/** @typedef {Pick<RunComparisonPublic, "unit"|"settings"> & {runs: (Run & {recipe?: Recipe})[], exports?: FileKind[]}} Outline */
/** @typedef {Pick<ComparisonJob, "state"|"done"|"total"|"error"> & {result: ComparisonResult|null}} Outcome */

/**
 * @typedef {object} Options
 * @property {Arrangement} [arrangement]
 * @property {boolean} [readOnly] Whether the runs can be watched but not moved.
 * @property {Partial<import("../session/keys.js").Actions>} [actions] Further actions of keys, besides moving through the runs.
 * @property {(runs: ComparedRun[]) => void} [onFewer] Called with the remaining runs when one is removed.
 */

/**
 * Compare runs: sessions are made for them, which end with the comparison.
 *
 * @param {Wanted} wanted
 * @param {(sentence: string) => void} tell Shows the progress while the caller waits; empty when there is nothing to wait for.
 * @param {Options} options
 * @returns {Promise<RunComparison>} Rejects if the runs cannot be compared.
 */
export async function compare({ runs, position = 0, arrangement }, tell, options) {
  const experiment = runs.find(({ recipe }) => recipe)?.recipe?.experiment ?? "";
  const page = new AbortController();
  /** @type {ComparisonJob} */
  const job = await whenCompiled(experiment, () => request("POST comparisons", { body: { runs } }), tell, page.signal);
  const comparison = job.result;
  if (comparison === null) throw new Error(job.error ?? "The runs could not be compared");
  const at = Math.min(position, comparison.frames - 1);
  const members = comparison.runs.map(({ shown, upload, first }) => ({ recipe: { recipe: shown, upload, position: first + at } }));
  const compared = new RunComparison(comparison, members, { ...options, arrangement });
  compared.follow(job);
  return compared;
}

/** Watch a comparison that another person controls.
 *
 * @param {Told} told
 * @param {readonly string[]} sessions
 */
export function watch({ outline, outcome, arrangement }, sessions) {
  const compared = new RunComparison(outline, sessions.map((session) => ({ session })), { arrangement, readOnly: true });
  if (outcome !== null) compared.know(outcome);
  return compared;
}

export class RunComparison extends JointView {
  outcome = signal(/** @type {Outcome|null} */ (null));
  arrangement = signal(/** @type {Arrangement} */ ("side"));
  view = signal(/** @type {ViewKind} */ ("flat"));

  /**
   * @param {Outline} outline
   * @param {readonly Pick<Member, "recipe"|"session">[]} sessions
   * @param {Options} options
   */
  constructor(outline, sessions, { arrangement = "side", readOnly = false, actions = {}, onFewer }) {
    const members = outline.runs.map(({ name, colour, first }, at) => ({ name, colour, first, label: `Run ${at + 1}, ${name}`, ...sessions[at] }));
    super(members, { kind: "compared-view", readOnly });
    this.outline = outline;
    this.onFewer = outline.runs.length > 2 ? onFewer : undefined;
    if (!readOnly) this.listen({ ...actions, difference: () => this.toDifference() });
    this.arrange(arrangement);
  }

  /** The recipes of the runs, where known. @returns {ComparedRun[]} */
  get runs() {
    return this.outline.runs.map(({ recipe }) => ({ recipe }));
  }

  /** The data that make the same comparison on another page. @returns {Wanted} */
  get wanted() {
    return { runs: this.runs, position: this.position, arrangement: this.arrangement.value };
  }

  /** The data that followers need to show the same sessions. @returns {Told} */
  get told() {
    const { outline: { unit, settings, runs }, outcome: { value: outcome } } = this;
    const named = runs.map(({ name, title, colour, first }) => ({ name, title, colour, first }));
    return { outline: { unit, settings, runs: named }, outcome: outcome?.state === "working" ? null : outcome, arrangement: this.arrangement.value };
  }

  /**
   * Follow the results while the server computes them. If the server no longer knows the comparison, as after a restart, request it again.
   *
   * @param {ComparisonJob} begun
   */
  async follow(begun) {
    let newest = begun;
    const hear = (/** @type {ComparisonJob|null} */ job) => {
      if (job === null) return;
      newest = job;
      const { state, done, total, error } = job;
      this.know({ state, done, total, error, result: job.result?.found ?? null });
    };
    this.signal.addEventListener("abort", () => newest.state === "working" && cancelJob(newest.id));
    hear(begun);
    try {
      await followJob(begun, hear, this.signal, () => request("POST comparisons", { body: { runs: this.runs }, signal: this.signal }));
    } catch (error) {
      if (!this.signal.aborted) this.know({ state: "failed", done: 0, total: 0, result: null, error: messageOf(error) });
    }
  }

  /** @param {Outcome} outcome The results of the runs so far. */
  know(outcome) {
    this.outcome.value = outcome;
    if (outcome.result === null) return;
    const { first_difference: frame, before_loss: beforeLoss } = outcome.result;
    const notes = frame === null ? [] : [{ frame, note: "The first frame in which two runs differ" }];
    this.store.whole.value = { beforeLoss, notes };
  }

  /** Go to the first frame in which two runs differ. */
  toDifference() {
    const frame = this.outcome.value?.result?.first_difference ?? null;
    if (frame !== null) this.steering.seek(frame);
  }

  /** @param {Arrangement} arrangement */
  arrange(arrangement) {
    this.arrangement.value = arrangement;
    if (arrangement === "over") this.show("flat");
    this.overlays.forEach((overlay, place) => {
      overlay.coat.value = arrangement === "over" ? { tint: rgb(this.outline.runs[place].colour), isLowest: place === 0 } : null;
    });
  }

  /** @param {ViewKind} kind */
  show(kind) {
    this.view.value = kind;
    if (kind === "scene") this.arrange("side");
    super.show(kind);
  }
}

/** @param {{compared: RunComparison}} props */
export function Comparison({ compared }) {
  const { outline } = compared;
  const { runs } = outline;
  return html`<div class="comparison" data-runs=${runs.length} data-arrangement=${compared.arrangement.value} style=${{ "--runs": String(runs.length) }}>
    <div class="comparison-views">${runs.map((run, place) => h(Compared, { compared, run, place }))}</div>
    <aside class="comparison-side" aria-label="What differs">
      ${h(Table, { outline, outcome: compared.outcome.value, measure: compared.measure })}
      ${h(Made, { make: () => compared.plotted() })}
    </aside>
    ${h(Made, { make: () => compared.deck("comparison-deck", h(DifferenceButton, { compared })) })}
  </div>`;
}

/** One of the runs: its name and its picture.
 *
 * @param {{compared: RunComparison, run: Outline["runs"][number], place: number}} props
 */
function Compared({ compared, run: { name, title, colour, recipe, first }, place }) {
  const { store, runs, onFewer } = compared;
  const hint = `${title ?? name}. Show its losses, changes and limits below`;
  const aim = () => linkTo({ recipe: /** @type {Recipe} */ (recipe), position: first + compared.position });
  const open = html`<span>Open</span>`;
  const remove = onFewer && h(IconButton, { name: "close", title: `Remove ${name}`, run: () => onFewer(runs.filter((_, other) => other !== place)) });
  return html`<section class="compared" aria-label=${`Run ${place + 1}, ${name}`} data-place=${place} style=${{ "--run": colour }}>
    <header class="compared-head">
      <h2>
        <button type="button" class="chip" aria-pressed=${String(place === store.front.value)} title=${hint} onClick=${() => (store.front.value = place)}>
          <span class="swatch" style=${{ background: colour }}></span><strong>${place + 1}</strong><span>${name}</span>
        </button>
      </h2>
      ${recipe && h(LinkNow, { class: "link", aim, title: "Open this run as a separate session, at this frame", content: open })}
      ${remove}
    </header>
    ${h(Made, { make: () => compared.places[place] })}
  </section>`;
}

/** A link to the frame that is shown when the link is followed.
 *
 * @param {{class: string, aim: () => string, title: string, label?: string, content: Child}} props
 */
export function LinkNow({ class: kind, aim, title, label, content }) {
  const now = (/** @type {Event & {currentTarget: HTMLAnchorElement}} */ { currentTarget }) => (currentTarget.href = aim());
  return html`<a class=${kind} href=${untracked(aim)} title=${title} aria-label=${label} onPointerEnter=${now} onFocus=${now} onClick=${now}>${content}</a>`;
}

/** @param {{compared: RunComparison}} props */
function DifferenceButton({ compared }) {
  const result = compared.outcome.value?.result ?? null;
  const frame = result?.first_difference ?? null;
  const there = frame === null ? "The runs are identical" : `Go to frame ${frame}, the first in which two runs differ (D)`;
  const words = frame === null ? "No difference" : `First difference ${frame}`;
  return html`<button type="button" disabled=${frame === null} title=${result && there} onClick=${() => compared.toDifference()}>
    ${result === null ? "First difference" : words}
  </button>`;
}

/**
 * @param {string} colour "#rrggbb"
 * @returns {[number, number, number]}
 */
function rgb(colour) {
  const value = Number.parseInt(colour.slice(1), 16);
  return [value >> 16, (value >> 8) & 255, value & 255];
}
