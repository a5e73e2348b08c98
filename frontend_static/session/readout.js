/** How the run goes, in a line, the numbers behind the picture, as the experiment declares them, and its branches. */

import { measureValue } from "../shared/format.js";
import { remember, remembered } from "../shared/memory.js";
import { isParticipant } from "../shared/participant.js";
import { Explained } from "../shared/terms.js";
import { h, html, useLayoutEffect, useSignal } from "../vendor/preact.js";
import { isMeasured, state, words } from "./readings.js";

/** @import { BranchPublic, MeasurePublic, SessionPublic } from "../shared/messages.js" */
/** @import { Mounted, View } from "./mount.js" */
/** @import { Child } from "../vendor/preact.js" */

/**
 * How it goes in the frame that is shown, and by how much it errs.
 *
 * @param {{view: Pick<View, "store">, ask?: Child}} props `ask` stands beside it.
 */
export function Status({ view: { store }, ask = null }) {
  const { session, history } = store;
  if (session === null) return html`<div class="verdict-row"><p class="verdict"></p>${ask}</div>`;
  const [text, kind] = state(history, session);
  const row = history.at(session.position);
  const reading = session.readings.find((each) => each.kind === "error");
  const error = reading && row && row.error !== null ? words(reading, row, session) : "";
  return html`
    <div class="verdict-row">
      <p class="verdict" data-kind=${kind}>${text}</p>
      <span class="verdict-error">${error}</span>
      ${ask}
    </div>
    ${session.look !== "" && html`<p class="look">${session.look}</p>`}
  `;
}

/** @param {{view: Pick<View, "store">}} props */
export function Numbers({ view: { store } }) {
  const { session, history } = store;
  if (session === null) return null;
  const row = history.at(session.position);
  const experiment = session.recipe.experiment;
  // A line that this tracker never reports is left out; one that is unknown in this frame only stays in its place.
  const shown = session.readings.filter((reading) => row === undefined || isMeasured(reading, row, session, history));
  return html`
    <dl>
      ${shown.map((reading) => [html`<dt>${h(Explained, { text: reading.title, experiment })}</dt>`, html`<dd>${words(reading, row, session)}</dd>`])}
    </dl>
    ${Object.values(session.doubts).map((why) => html`<p class="doubts">
      ${why}${" "}${!isParticipant && html`<a href="help/explanation/calibration.html">About bands</a>`}
    </p>`)}
    ${h(Measures, { session })}
  `;
}

/**
 * What the run so far gives beside its truth: the measure that decides on success, and unfolded all others.
 *
 * @param {{session: SessionPublic}} props
 */
function Measures({ session }) {
  const { measured, computed, frames, measures, success_measure: decides } = session;
  // Without a truth there is nothing to measure.
  const known = measures.filter(({ name }) => name in measured);
  const decisive = known.find(({ name }) => name === decides) ?? known[0];
  if (decisive === undefined) return null;
  const value = (/** @type {MeasurePublic} */ measure) => measureValue(measured[measure.name], measure, computed + 1);
  const others = known.filter((measure) => measure !== decisive);
  return html`<div class="measures">
    <span class="leading">${computed + 1 < frames ? "So far: " : "Whole run: "}${h(MeasureName, decisive)}</span>
    <details>
      <summary aria-label="All measures" title="All measures"><strong>${value(decisive)}</strong></summary>
      <dl>${others.map((measure) => html`<dt>${h(MeasureName, measure)}</dt><dd>${value(measure)}</dd>`)}</dl>
    </details>
  </div>`;
}

/** @param {MeasurePublic} measure */
function MeasureName({ title, description }) {
  return h(Explained, { text: title.charAt(0).toLowerCase() + title.slice(1), own: description });
}

/** Where this browser keeps what a person has unfolded beside the picture. */
const FOLDS = "pftrack-side";

/**
 * What is folded beside a picture, as a person has left it: all plots but the first two, and the numbers.
 *
 * @param {{view: Pick<View, "store">, plots: HTMLElement|null}} props `plots` holds the plots.
 */
export function Folded({ view, plots }) {
  const open = useSignal(/** @type {Unfolded} */ (JSON.parse(remembered(FOLDS) ?? "{}")));
  const { isAll = false, hasNumbers = false } = open.value;
  useLayoutEffect(() => void plots?.setAttribute("data-shown", isAll ? "all" : "first"), [isAll]);
  const change = (/** @type {Unfolded} */ next) => {
    open.value = { ...open.value, ...next };
    remember(FOLDS, JSON.stringify(open.value));
  };
  const plotsButton = html`<button type="button" class="quiet" aria-expanded=${String(isAll)} onClick=${() => change({ isAll: !isAll })}>Plots</button>`;
  return html`
    <div class="side-folds">
      ${(view.store.session?.plots.length ?? 0) > 2 && plotsButton}
      <button type="button" class="quiet" aria-expanded=${String(hasNumbers)} onClick=${() => change({ hasNumbers: !hasNumbers })}>Numbers</button>
    </div>
    ${hasNumbers && h(Numbers, { view })}
  `;
}

/** @typedef {{isAll?: boolean, hasNumbers?: boolean}} Unfolded Whether all plots are shown, and whether the numbers are. */

/**
 * The branches, between which one switches.
 *
 * @param {{view: Mounted, place: HTMLElement}} props `place` is hidden while there is one branch alone.
 */
export function Branches({ view, place }) {
  const { branches = [] } = view.store.session ?? {};
  place.hidden = branches.length < 2;
  return branches.map((branch) => h(Chip, { key: branch.id, branch, view }));
}

/** @param {{branch: BranchPublic, view: Mounted}} props */
function Chip({ branch: { id, title, parent, frame, colour }, view: { store, commands } }) {
  const active = id === store.known.branch;
  const hint = parent ? `Branched from frame ${frame}` : "The run as it began";
  const content = html`<span class="swatch" style=${`background: ${colour}`}></span><span>${title}</span>`;
  if (store.isReadOnly) return html`<span class="chip" title=${hint} aria-current=${active ? "true" : null}>${content}</span>`;
  const activate = () => active || commands.activate(id);
  return html`<button type="button" class="chip" aria-pressed=${String(active)} title=${hint} onClick=${activate}>${content}</button>`;
}
