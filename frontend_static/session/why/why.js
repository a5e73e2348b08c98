/** Why the target was lost, and what-if, in place of the plots. */

import { IconButton, Segments } from "../../shared/dom.js";
import { plainAxis } from "../../shared/figure/axes.js";
import { StillFigure } from "../../shared/figure/figure.js";
import { lineOver } from "../../shared/figure/kinds.js";
import { number, quantity } from "../../shared/format.js";
import { newSweep } from "../../shared/share_link.js";
import { h, html, useEffect, useRef, useSignal } from "../../vendor/preact.js";
import { repeated } from "../steering.js";

/** @import { Evidence, Report, Sign, ToldFinding } from "../../shared/messages.js" */
/** @import { Loss } from "./loss.js" */

// The card over the foot of the picture of a run that lost its target: the cause in a sentence, the best change of the tracker and
// of the scene, and buttons for more. Closed, it stays small.

/** @param {{loss: Loss}} props */
export function LostCard({ loss }) {
  const { explanation, isAway, isLost, view } = loss;
  const { before = null, diagnosis: told } = explanation.value ?? {};
  if (!told?.lost) return null;
  // An open tab shows the same content.
  const isOpen = !(isAway.value ?? (!isLost.value || loss.tab !== null));
  const turn = (/** @type {Event & {currentTarget: HTMLDetailsElement}} */ { currentTarget: { open } }) => {
    if (open !== isOpen) isAway.value = !open;
  };
  return html`<section class="lost-card" aria-label="The loss" data-stale=${String(!isLost.value)}>
    <p class="visually-hidden" role="status">${isLost.value && told.sentence}</p>
    <details open=${isOpen} onToggle=${turn}>
      <summary title=${isOpen ? "Close" : "Why, and what would have saved it"}>
        <span>${isOpen ? told.sentence : `Lost in frame ${told.frame}`}</span> ${!isLost.value && h(Stale, {})}
      </summary>
      ${loss.offersChanges && html`<ul>${h(Cure, { loss, ofScene: false })} ${h(Cure, { loss, ofScene: true })}</ul>`}
      <footer>
        <button type="button" onClick=${() => loss.open()}>Why</button>
        ${loss.offersChanges && html`<button type="button" onClick=${() => (view.card.value = "what-if")}>What if…</button>`}
        <button type="button" title="Shortly before the loss" onClick=${() => view.steering.seek(before ?? 0)}>Go to frame ${before}</button>
        ${loss.offersChanges && html`<span class="hint">${without(loss)}</span>`}
      </footer>
    </details>
  </section>`;
}

/** The best change of the tracker or of the scene, if one is better than no change.
 *
 * @param {{loss: Loss, ofScene: boolean}} props
 */
function Cure({ loss, ofScene }) {
  const { exploration: { isStale }, report } = loss;
  const best = report.value?.findings.find(({ kind, verdict }) => (kind === "world") === ofScene && verdict === "better");
  if (best === undefined) return null;
  return html`<li data-stale=${String(isStale)}>
    <span class="of">${ofScene ? "Scene" : "Tracker"}</span>
    <span class="change"><strong>${best.title}</strong> ${best.shares} ${isStale && h(Stale, {})}</span>
    ${h(TryOut, { loss, finding: best })}
  </li>`;
}

/**
 * Why no change is shown, or nothing if one is.
 *
 * @param {Loss} loss
 */
function without({ exploration, report }) {
  const verdicts = report.value?.findings.filter(({ kind }) => kind !== "seeds").map(({ verdict }) => verdict) ?? [];
  if (verdicts.includes("better")) return "";
  if (exploration.error.value !== "") return exploration.error.value;
  if (exploration.isWorking) return "Trying changes…";
  return verdicts.length === 0 || verdicts.includes("few") ? "Too few seeds to tell" : "No change is clearly better";
}

/** @param {{loss: Loss, finding: ToldFinding}} props */
function TryOut({ loss, finding }) {
  const { title, seed } = finding;
  const words = { title: `Opens a branch with the seed ${seed}`, "aria-label": `Try it: ${title}` };
  return html`<button type="button" ...${words} disabled=${seed === null || !loss.canTry} onClick=${() => loss.tryOut(finding)}>Try it</button>`;
}

function Stale() {
  return html`<span class="stale" title="The run has changed since">stale</span>`;
}

// What-if: changes of the tracker and of the scene, best first, in growing lists.

const TRIALS = 40;

/** @param {{loss: Loss}} props */
function WhatIf({ loss }) {
  const { explanation, exploration, report } = loss;
  const [job, found, error] = [exploration.job.value, report.value, exploration.error.value];
  const frame = explanation.value?.diagnosis.frame;
  // The findings may be about another loss than the last *Why?*.
  const which = found?.loss === frame ? "" : found?.loss_sentence;
  const words = found === null ? error || "Going back to before the loss…" : `${which} ${found.sentence} ${error}`;
  const stop = () => {
    exploration.stop();
    exploration.error.value = "Stopped.";
  };
  const again = () => loss.ask(frame ?? undefined);
  return html`<div class="what-if" data-stale=${String(exploration.isStale)}>
    <p class="what-if-status" role="status">${words} ${exploration.isStale && h(Stale, {})}</p>
    ${exploration.isWorking && html`<div class="what-if-progress">
      <progress aria-label="Runs carried out" max=${job?.total || 1} value=${job?.done}></progress>
      <button type="button" class="quiet" onClick=${stop}>Stop</button>
    </div>`}
    ${loss.isCut && html`<button type="button" onClick=${again}>Try again</button>`}
    ${found && h(Changes, { loss, found })}
  </div>`;
}

/** @param {{loss: Loss, found: Report}} props */
function Changes({ loss, found }) {
  const isWhole = useSignal(false);
  const [first, ...changes] = found.findings;
  const lists = /** @type {const} */ (["tracker", "scene"]).map(
    (of) => /** @type {const} */ ([of, changes.filter(({ kind }) => (kind === "world") === (of === "scene"))]),
  );
  const line = (/** @type {ToldFinding} */ finding) => h(Line, { key: JSON.stringify(finding.values), loss, finding });
  const shown = lists.filter(([, some]) => some.length > 0).map(
    ([of, some]) => html`<h3>Changes of the ${of}</h3>
      <ol class="what-if-lines" aria-label=${`Changes of the ${of}, best first`}>${(isWhole.value ? some : some.slice(0, 1)).map(line)}</ol>`,
  );
  const best = changes.find(({ verdict }) => verdict === "better");
  const hint = "Compare the best change with no change over many scenes and seeds";
  return html`
    <ul class="what-if-lines" aria-label="No change">${line(first)}</ul>
    ${shown}
    <footer>
      ${changes.length > shown.length && html`<button type="button" aria-expanded=${String(isWhole.value)} onClick=${() => (isWhole.value = !isWhole.value)}>
        ${isWhole.value ? "Only the best" : `All ${found.planned}`}
      </button>`}
      ${best && html`<a class="button" href=${sweepOf(loss, best)} title=${hint}>Check in a sweep…</a>`}
    </footer>
    <p class="hint">${found.correction} A cure of this run is not a cure in general.</p>
  `;
}

/**
 * A change with the share of runs that hold, its verdict and its cost.
 *
 * @param {{loss: Loss, finding: ToldFinding}} props
 */
function Line({ loss, finding }) {
  const { title, shares, share, low, high, step_ms: cost, verdict, words } = finding;
  const percent = (/** @type {number|null} */ value) => `${number(100 * (value ?? 0), 0)}%`;
  const hint = "Vary this in a sweep, over many scenes and seeds";
  const interval = `95 % interval ${percent(low)} to ${percent(high)}`;
  return html`<li data-verdict=${verdict}>
    <span class="what-if-title">${title}</span>
    <span class="what-if-result">
      <span class="share-bar" role="img" title=${interval} aria-label=${`${percent(share)} of the runs hold; ${interval}`}>
        <i class="share" style=${`width: ${percent(share)}`}></i>
        <i class="interval" style=${`left: ${percent(low)}; width: ${percent((high ?? 0) - (low ?? 0))}`}></i>
      </span>
      <span class="what-if-count">${shares}</span>
    </span>
    <span class="what-if-tools">
      <span class="what-if-said">${[words, `${number(cost, cost < 1 ? 2 : 1)} ms a step`].filter(Boolean).join(" · ")}</span>
      ${verdict !== "baseline" && html`<a class="link" href=${sweepOf(loss, finding)} title=${hint}>Sweep</a>`}
      ${h(TryOut, { loss, finding })}
    </span>
  </li>`;
}

/** A sweep over a change and no change, with the run's first settings.
 *
 * @param {Loss} loss
 * @param {ToldFinding} finding
 */
function sweepOf({ view, parameters }, { values, parameter }) {
  const plan = repeated(view.store.known);
  const trackers = [...new Set([...plan.trackers, ...("tracker" in values ? [String(values.tracker)] : [])])];
  const axes = parameter ? [{ name: parameter, values: [parameters[parameter], values[parameter]] }] : [];
  const rest = Object.fromEntries(Object.entries(plan.parameters).filter(([name]) => name !== parameter));
  return newSweep({ ...plan, axes, trackers, trials: TRIALS, parameters: rest });
}

const TABS = /** @type {const} */ ([{ value: "why", words: "Why?" }, { value: "what-if", words: "What if…" }]);

/** @param {{loss: Loss}} props */
export function Beside({ loss }) {
  const { tab: shown, view: { card } } = loss;
  const root = useRef(/** @type {HTMLElement|null} */ (null));
  // It is read next, while keys continue to steer the session; the card with the pressed button has closed.
  useEffect(() => root.current?.focus(), [shown === null]);
  if (shown === null) return null;
  const close = () => {
    // Keys steer the session from there, too.
    /** @type {HTMLElement|null|undefined} */ (root.current?.closest(".session-view")?.querySelector(".play"))?.focus({ preventScroll: true });
    card.value = null;
  };
  const press = (/** @type {KeyboardEvent} */ event) => {
    if (event.key !== "Escape") return;
    event.stopPropagation();
    close();
  };
  const options = TABS.filter(({ value }) => value === "why" || loss.offersChanges);
  const choose = (/** @type {string} */ wanted) => (card.value = wanted === "why" ? "why" : "what-if");
  return html`<div ref=${root} class="beside" tabindex="-1" onKeyDown=${press}>
    <header>
      ${h(Segments, { label: "About the loss", options, value: shown, choose })}
      ${h(IconButton, { name: "close", title: "Back to the plots", run: close })}
    </header>
    ${shown === "why" ? h(Why, { loss }) : h(WhatIf, { loss })}
  </div>`;
}

/** The button that asks why on a clip without a known loss; the answer explains how to mark the truth.
 *
 * @param {{loss: Loss}} props
 */
export function WhyButton({ loss }) {
  const { session, history, isReadOnly } = loss.view.store;
  if (isReadOnly || !session?.recipe.footage || history.length < 2 || loss.isLost.value) return null;
  return html`<button type="button" class="why-ask" title="Was it lost, and why? (W)" onClick=${() => loss.open()}>Why?</button>`;
}

/** @param {{loss: Loss}} props */
function Why({ loss }) {
  const { explanation, refusal, view } = loss;
  const told = explanation.value?.diagnosis ?? null;
  const ask = () => loss.ask(view.store.known.position);
  const signs = told?.signs.map((sign) => h(Signed, { key: `${sign.title} ${sign.since}`, sign, go: () => view.steering.seek(sign.since) }));
  const words = told === null ? html`<div class="late"><div class="bone shimmer"></div></div>` : html`<p class="why-sentence">${told.sentence}</p>${signs}
    ${told.reliability && html`<p class="why-reliability">${told.reliability}</p>`}`;
  return html`
    <div class="why-words" role="status">${refusal.value === "" ? words : html`<p class="error">${refusal.value}</p>`}</div>
    <button type="button" class="quiet" title="Explain the shown frame" onClick=${ask}>This frame</button>
  `;
}

/** @param {{sign: Sign, go: () => void}} props */
function Signed({ sign: { title, since, words, evidence }, go }) {
  return html`<section class="sign">
    <h3><span>${title}</span><button type="button" class="quiet" title="Go to its first frame" onClick=${go}>Frame ${since}</button></h3>
    <p>${words}</p>
    <div class="evidences" onClick=${go}>${evidence.map((column) => h(Course, { key: column.name, column, since }))}</div>
  </section>`;
}

/**
 * A small plot of a column around the frame in which a sign began, which a line marks.
 *
 * @param {{column: Evidence, since: number}} props
 */
function Course({ column: { title, unit, first, values }, since }) {
  const known = values.filter((value) => value !== null);
  const [low, high] = [Math.min(...known), Math.max(...known)];
  const last = first + values.length - 1;
  const range = `${quantity(low, unit)} to ${quantity(high, unit)} ${unit}`.trim();
  const words = `${title}, ${range}, over frames ${first} to ${last}; frame ${since} is marked`;
  const y = values.map((value) => value ?? NaN);
  const x = values.map((_, place) => first + place);
  const traces = [
    lineOver({ x: [since, since], y: [low, high], ink: "lost", width: 1.5, dashed: true }),
    lineOver({ x, y, ink: "estimate", width: 2 }),
  ];
  const [across, up] = [{ low: first, high: Math.max(last, first + 1) }, { low, high: high > low ? high : low + 1 }];
  const panel = { x: plainAxis({ ...across, hidden: true }), y: plainAxis({ ...up, hidden: true }), traces };
  return html`<figure class="evidence" title=${words}>
    ${h(StillFigure, { kind: "figure-miniature", words, panels: [panel] })}
    <figcaption><span>${title}</span><span>${range}</span></figcaption>
  </figure>`;
}
