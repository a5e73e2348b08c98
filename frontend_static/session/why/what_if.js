/** What would have saved the run: changes of the tracker and of the scene, best first, in lists that fill. */

import { number } from "../../shared/format.js";
import { newSweep } from "../../shared/share_link.js";
import { h, html, useSignal } from "../../vendor/preact.js";
import { Stale, TryOut } from "./lost_card.js";

/** @import { Report, ToldFinding } from "../../shared/messages.js" */
/** @import { Loss } from "./loss.js" */

const TRIALS = 40;

/** @param {{loss: Loss}} props */
export function WhatIf({ loss }) {
  const { diagnosis, exploration, report } = loss;
  const [job, found, error] = [exploration.job.value, report.value, exploration.error.value];
  // The findings may be about another loss than *Why?* was asked about last.
  const which = found?.loss === diagnosis.value?.frame ? "" : found?.loss_sentence;
  const words = found === null ? error || "Going back to before the loss…" : `${which} ${found.sentence} ${error}`;
  const stop = () => {
    exploration.stop();
    exploration.error.value = "Stopped.";
  };
  const again = () => loss.ask(diagnosis.value?.frame ?? undefined);
  return html`<div class="what-if" data-stale=${String(job?.stale)}>
    <p class="what-if-status" role="status">${words} ${job?.stale && h(Stale, {})}</p>
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
        ${isWhole.value ? "The best alone" : `All ${found.planned}`}
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

/**
 * A sweep over a change and none, with the settings that the run began with.
 *
 * @param {Loss} loss
 * @param {ToldFinding} finding
 */
function sweepOf({ view, parameters }, { values, parameter }) {
  const { recipe, tracker, upload } = view.store.known;
  const [first] = recipe.timeline ?? [];
  const begun = first?.frame === 0 ? first.values : {};
  const trackers = [...new Set([recipe.tracker ?? tracker, ...("tracker" in values ? [String(values.tracker)] : [])])];
  const axes = parameter ? [{ name: parameter, values: [parameters[parameter], values[parameter]] }] : [];
  const rest = Object.fromEntries(Object.entries(begun).filter(([name]) => name !== parameter));
  const on = upload ? { upload, footage: recipe.footage } : {};
  return newSweep({ experiment: recipe.experiment, axes, trackers, trials: TRIALS, parameters: rest, ...on });
}
