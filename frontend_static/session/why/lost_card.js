/**
 * The card over the foot of the picture of a run that lost its target: the cause in a sentence, the best change of the tracker and
 * of the scene, and buttons that lead on. Put away, it stays small.
 */

import { h, html } from "../../vendor/preact.js";

/** @import { ToldFinding } from "../../shared/messages.js" */
/** @import { Loss } from "./loss.js" */

/** @param {{loss: Loss}} props */
export function LostCard({ loss }) {
  const { diagnosis, isAway, isLost, tab, view } = loss;
  const told = diagnosis.value;
  if (told === null || !told.lost) return null;
  // An open tab shows the same.
  const isOpen = !(isAway.value ?? (!isLost.value || tab.value !== null));
  // The first sign of the loss, or the loss itself.
  const goal = Math.min(told.frame ?? 0, ...told.signs.map(({ since }) => since));
  const turn = (/** @type {Event & {currentTarget: HTMLDetailsElement}} */ { currentTarget: { open } }) => {
    if (open !== isOpen) isAway.value = !open;
  };
  return html`<section class="lost-card" aria-label="The loss" data-stale=${String(!isLost.value)}>
    <p class="visually-hidden" role="status">${isLost.value && told.sentence}</p>
    <details open=${isOpen} onToggle=${turn}>
      <summary title=${isOpen ? "Put away" : "Why, and what would have saved it"}>
        <span>${isOpen ? told.sentence : `Lost in frame ${told.frame}`}</span> ${!isLost.value && h(Stale, {})}
      </summary>
      ${loss.offersChanges && html`<ul>${h(Cure, { loss, ofScene: false })} ${h(Cure, { loss, ofScene: true })}</ul>`}
      <footer>
        <button type="button" onClick=${() => loss.open()}>Why</button>
        ${loss.offersChanges && html`<button type="button" onClick=${() => (tab.value = "what-if")}>What if…</button>`}
        <button type="button" onClick=${() => view.steering.seek(goal)}>Go to frame ${goal}</button>
      </footer>
    </details>
  </section>`;
}

/**
 * The best change of the tracker or of the scene, where one is better than no change.
 *
 * @param {{loss: Loss, ofScene: boolean}} props
 */
function Cure({ loss, ofScene }) {
  const { exploration, report } = loss;
  const findings = report.value?.findings.filter(({ kind }) => (ofScene ? kind === "world" : !["world", "seeds"].includes(kind))) ?? [];
  // The scene of a recording cannot change.
  if (ofScene && findings.length === 0) return null;
  const best = findings.find(({ verdict }) => verdict === "better");
  const of = ofScene ? "Scene" : "Tracker";
  const why = best === undefined && without(loss, findings.length === 0 || findings.some(({ verdict }) => verdict === "few"));
  if (best === undefined) return html`<li><span class="of">${of}</span> <span class="hint">${why}</span></li>`;
  return html`<li data-stale=${String(exploration.job.value?.stale)}>
    <span class="of">${of}</span>
    <span class="change"><strong>${best.title}</strong> ${best.shares} ${exploration.job.value?.stale && h(Stale, {})}</span>
    ${h(TryOut, { loss, finding: best })}
  </li>`;
}

/**
 * Why no change is shown.
 *
 * @param {Loss} loss
 * @param {boolean} isOpen Whether there are too few seeds to tell.
 */
function without({ exploration }, isOpen) {
  if (exploration.error.value !== "") return exploration.error.value;
  if (exploration.isWorking) return isOpen ? "Too few seeds to tell. Trying…" : "No change is clearly better so far. Trying…";
  return isOpen ? "Too few seeds to tell" : "No change is clearly better";
}

/** @param {{loss: Loss, finding: ToldFinding}} props */
export function TryOut({ loss, finding }) {
  const { title, seed } = finding;
  const words = { title: `Opens a branch with the seed ${seed}`, "aria-label": `Try it: ${title}` };
  return html`<button type="button" ...${words} disabled=${seed === null || !loss.canTry} onClick=${() => loss.tryOut(finding)}>Try it</button>`;
}

export function Stale() {
  return html`<span class="stale" title="The run has changed since">stale</span>`;
}
