/** The row of controls above the scrubber: position, speed, and events of the run. */

import { request } from "../shared/api.js";
import { attempt, Icon, IconButton, Popover, renderIn, Select } from "../shared/dom.js";
import { measureValue, percent, speed as speedText } from "../shared/format.js";
import { Explained } from "../shared/terms.js";
import { isParticipant, remember, remembered } from "../shared/visitor.js";
import { h, html, useLayoutEffect, useSignal } from "../vendor/preact.js";
import { isMeasured, ofRole, readingWords, state } from "./readings.js";
import { bookmark, steer } from "./steering.js";

/** @import { IconName } from "../shared/dom.js" */
/** @import { Bookmark, BranchPublic, MeasurePublic, SessionPublic } from "../shared/messages.js" */
/** @import { Child } from "../vendor/preact.js" */
/** @import { Mounted, View } from "./mount.js" */

// The verdict on the run in a line, the experiment's numbers for the picture, and the branches.

/** The verdict on the shown frame, and its error.
 *
 * @param {{view: Pick<View, "store">, ask?: Child}} props `ask` is next to it.
 */
export function Status({ view: { store }, ask = null }) {
  const { session, history } = store;
  if (session === null) return html`<div class="verdict-row"><p class="verdict"></p>${ask}</div>`;
  const [text, kind] = state(history, session);
  const row = history.at(session.position);
  const reading = session.readings.find((each) => each.kind === "error");
  const error = reading && row && row.error !== null ? readingWords(reading, row, session) : "";
  return html`
    <div class="verdict-row">
      <p class="verdict" data-kind=${kind}>${text || (error && reading?.title)}</p>
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
  // A line that this tracker never reports is left out; one that is unknown only in this frame keeps its place.
  const shown = session.readings.filter((reading) => row === undefined || isMeasured(reading, row, session, history));
  return html`
    <dl>
      ${shown.map((reading) => [html`<dt>${h(Explained, { text: reading.title, experiment })}</dt>`, html`<dd>${readingWords(reading, row, session)}</dd>`])}
    </dl>
    ${Object.values(session.doubts).map((why) => html`<p class="doubts">
      ${why}${" "}${!isParticipant && html`<a href="help/explanation/calibration.html">About bands</a>`}
    </p>`)}
    ${h(Measures, { session })}
  `;
}

/** The run so far compared with its truth: the success measure, and all others when unfolded.
 *
 * @param {{session: SessionPublic}} props
 */
function Measures({ session }) {
  const { measured: found, computed, frames, measures, success_measure: decides } = session;
  // Without truth there is nothing to measure.
  const known = measures.filter(({ name }) => name in found);
  const decisive = known.find(({ name }) => name === decides) ?? known[0];
  if (decisive === undefined) return null;
  const value = (/** @type {MeasurePublic} */ measure) => measureValue(found[measure.name], measure, computed + 1);
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

/** Storage key of the folds next to the picture. */
const FOLDS = "pftrack-side";

/** The folds next to a picture, in a person's last state: all plots but the first two, and the numbers.
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

/** The branches to switch between.
 *
 * @param {{view: Mounted, place: HTMLElement}} props `place` is hidden while there is only one branch.
 */
export function Branches({ view, place }) {
  const { branches = [] } = view.store.session ?? {};
  place.hidden = branches.length < 2;
  return branches.map((branch) => h(Chip, { key: branch.id, branch, view }));
}

/** @param {{branch: BranchPublic, view: Mounted}} props */
function Chip({ branch: { id, title, parent, frame, colour }, view: { store } }) {
  const active = id === store.known.branch;
  const hint = parent ? `Branched from frame ${frame}` : "The original run";
  const content = html`<span class="swatch" style=${`background: ${colour}`}></span><span>${title}</span>`;
  if (store.isReadOnly) return html`<span class="chip" title=${hint} aria-current=${active ? "true" : null}>${content}</span>`;
  const activate = () => active || steer(store, { kind: "activate", branch: id });
  return html`<button type="button" class="chip" aria-pressed=${String(active)} title=${hint} onClick=${activate}>${content}</button>`;
}

/** Least delay to show. */
const LATE_S = 0.5;
const NEXT_EVENT = "Go to the next event, such as an identity switch (E; with shift, to the previous one)";
const BEFORE_LOSS = "Go to before the target was lost (L)";
const LABELS = { pause: "Pause", replay: "Play again", play: "Play" };
/** Probabilities at which a run may stop. */
const LIMITS = [0.5, 0.8, 0.95];
/** Label and explanation of the switch for each kind of run. */
const SCENE = ["Stop when probably lost", "Pause when the tracker has probably lost its target, by its own estimate"];
const RECORDING = ["Stop when lost", "Pause when a mark or the tracker itself reports a loss. P(lost) is not calibrated on recordings."];

/**
 * Put the transport into a place.
 *
 * @param {HTMLElement} root
 * @param {View} view
 * @param {Child} extras Further controls, at the right.
 */
export function transport(root, view, extras) {
  renderIn(root, h(Transport, { view, extras }), view.signal);
  // A click must not leave the focus on a button, where the space bar would press it again instead of playing.
  root.addEventListener("mousedown", (event) => {
    if (!(event.target instanceof Element) || !event.target.closest("button")) return;
    event.preventDefault();
    /** @type {HTMLElement|null} */ (root.closest(".session-view"))?.focus({ preventScroll: true });
  });
}

/** @param {{view: View, extras: Child}} props */
function Transport({ view, extras }) {
  const { store, steering } = view;
  const { session, isSteerable } = store;
  const still = steering.isAtEnd ? "replay" : "play";
  const look = steering.isPlaying ? "pause" : still;
  const button = (/** @type {IconName} */ name, /** @type {string} */ title, /** @type {() => void} */ run) =>
    h(IconButton, { name, title, run, class: "icon-only", disabled: !isSteerable });
  const landmark = (/** @type {string} */ name, /** @type {string} */ words, /** @type {string} */ title, /** @type {() => void} */ run) =>
    html`<button type="button" class=${name} title=${title} disabled=${!isSteerable} onClick=${run}>${words}</button>`;
  const hasEvents = session !== null && ofRole(session, "event").length > 0;
  return html`
    <div class="group">
      ${button("first", "First frame (home)", () => view.steering.seek(0))}
      ${button("previous", "One frame back (left arrow)", () => view.steering.step(-1))}
      <button type="button" class="primary play" title=${`${LABELS[look]} (space)`} disabled=${!isSteerable} onClick=${() => view.steering.toggle()}>
        ${h(Icon, { name: look })}<span>${LABELS[look]}</span>
      </button>
      ${button("next", "One frame forward (right arrow)", () => view.steering.step(1))}
      ${button("last", "Newest frame (end)", () => view.steering.newest())}
    </div>
    ${h(Speed, { view })}
    <output class="counter" aria-label="Frame">${session && counted(session)}</output>
    <span class="hint" role="status" data-role="late" title="Frames take longer to compute than to play">${session && lateness(session)}</span>
    <span class="hint" role="status" data-role="stopped">${session?.stopped}</span>
    <span class="spring"></span>
    ${extras}
    ${hasEvents && landmark("next-event", "Next event", NEXT_EVENT, () => view.steering.event(1))}
    ${store.knowsLoss && landmark("before-loss", "Before the loss", BEFORE_LOSS, () => view.steering.beforeLoss())}
  `;
}

/** The offered speeds, and one that another client has set.
 *
 * @param {{view: View}} props
 */
function Speed({ view: { steering, store } }) {
  const { speed = 1, speeds = [] } = store.session ?? {};
  const offered = speeds.includes(speed) ? speeds : [...speeds, speed];
  const options = offered.map((each) => ({ value: String(each), words: speedText(each) }));
  const choose = (/** @type {string} */ chosen) => steering.setSpeed(Number(chosen));
  return h(Select, { label: "Speed", title: "Speed ([ and ])", disabled: !store.isSteerable, options, value: String(speed), choose });
}

/** The delay of a playing run that is computed more slowly than it should play.
 *
 * @param {SessionPublic} session
 */
function lateness({ playing, behind_s: seconds }) {
  return playing && seconds >= LATE_S ? `${seconds.toFixed(1)} s late` : "";
}

/** The run's position; for a recording also that in the clip, as the upload form counts.
 *
 * @param {SessionPublic} session
 */
function counted({ position, frames, recipe: { footage } }) {
  const frame = `frame ${position} / ${frames}`;
  return footage ? `${frame}, picture ${footage.start + position} of the clip` : frame;
}

/**
 * The switch that stops a run where its target is probably lost, with its limit. The server decides, and reports why it has stopped. Hidden
 * in a scene whose trackers have no such probability.
 *
 * @param {{view: View}} props
 */
export function StopAtLoss({ view: { store, steering } }) {
  const { session } = store;
  const isRecording = Boolean(session?.recipe.footage);
  if (session === null || store.isReadOnly || !(isRecording || ofRole(session, "loss_probability").length > 0)) return null;
  const [words, why] = isRecording ? RECORDING : SCENE;
  const at = session.stop_at;
  const stop = (/** @type {number|null} */ probability) => steering.send({ kind: "stop_at", probability });
  const toggle = (/** @type {Event & {currentTarget: HTMLInputElement}} */ { currentTarget }) => stop(currentTarget.checked ? LIMITS[0] : null);
  const limits = at === null || LIMITS.includes(at) ? LIMITS : [...LIMITS, at];
  const options = limits.map((each) => ({ value: String(each), words: percent(each) }));
  const label = "Probability of a loss at which to pause";
  return html`<div class="control stop-at-loss">
    <label title=${why}><input type="checkbox" checked=${at !== null} onChange=${toggle} /><span>${words}</span></label>
    ${at !== null && !isRecording && h(Select, { label, title: why, options, value: String(at), choose: (limit) => stop(Number(limit)) })}
  </div>`;
}

/**
 * The bookmarks: a button with a list under it; each entry goes to its frame.
 *
 * @param {{view: Mounted}} props
 */
export function Bookmarks({ view }) {
  const marks = [...(view.store.session?.bookmarks ?? [])].sort((a, b) => a.frame - b.frame);
  const add = (/** @type {Event & {currentTarget: HTMLFormElement}} */ event) => {
    const form = event.currentTarget;
    event.preventDefault();
    bookmark(view.store, String(new FormData(form).get("note")).trim());
    form.reset();
  };
  const content = html`
    <form class="menu-form" onSubmit=${add}>
      <input type="text" maxlength="200" placeholder="Note for this frame" aria-label="Note" name="note" />
      <button type="submit" title="Bookmark this frame (B)">Add</button>
    </form>
    <ul class="menu-list">
      ${marks.length === 0 && html`<li class="hint">None yet. B bookmarks the shown frame.</li>`}
      ${marks.map((mark) => h(Marked, { key: mark.id, mark, view }))}
    </ul>
  `;
  const words = html`<span class="wide-only">Bookmarks</span><span class="amount">${marks.length || ""}</span>`;
  return h(Popover, { icon: "bookmark", label: "Bookmarks", title: "Bookmarks (B adds one)", words, content });
}

/** @param {{mark: Bookmark, view: Mounted}} props */
function Marked({ mark, view: { store, steering } }) {
  const go = async () => {
    if (mark.branch && mark.branch !== store.known.branch) await steer(store, { kind: "activate", branch: mark.branch });
    await steering.seek(mark.frame);
  };
  const remove = () => attempt(() => request("DELETE sessions/{session}/bookmarks/{bookmark}", { session: store.known.id, bookmark: mark.id }));
  return html`<li>
    <button type="button" class="quiet grow" onClick=${go}>frame ${mark.frame}${mark.note && html`<span class="hint">${mark.note}</span>`}</button>
    ${h(IconButton, { name: "trash", title: `Remove the bookmark at frame ${mark.frame}`, run: remove })}
  </li>`;
}
