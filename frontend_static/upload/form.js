/** The form after an upload: first frame, target, tracker, and the target's suitability. */

import { messageOf, Meter, request } from "../shared/api.js";
import { Select } from "../shared/dom.js";
import { count } from "../shared/format.js";
import { Made } from "../shared/page.js";
import { VIRIDIS } from "../shared/palette.js";
import { later } from "../shared/timing.js";
import { h, html, useEffect, useMemo, useRef, useSignal } from "../vendor/preact.js";
import { Target } from "./target.js";

/** @import { Mark } from "../shared/marks/mark_json.js" */
/** @import { ExperimentPublic, SuitabilityPublic, UploadPublic } from "../shared/messages.js" */
/** @import { Child } from "../vendor/preact.js" */
/** @import { Finding as FindingState } from "./target.js" */

/** @typedef {Event & {currentTarget: HTMLInputElement}} InputEvent */

/** @type {Record<string, string>} The content of frames that are not pictures, by the kind of recording. */
const WITHOUT_PICTURES = { tracks: " of tracks", beliefs: " of recorded beliefs" };
/** The kind of recording with another program's results. */
const DONE = "beliefs";
/** Delay before a mark is judged: while a box is dragged, it changes with every movement. */
const STILL_MS = 250;
const SLOW_MS = 400;
const RAMP = `background: linear-gradient(90deg, ${VIRIDIS.map((colour) => `rgb(${colour.join(" ")})`).join(", ")})`;
const CHECKING = "Checking whether this target can be tracked";
const TRUTH_FILES = ".csv,.txt,.xml,.json,text/csv";

/** @param {{upload: UploadPublic, experiments: ExperimentPublic[], leave: () => void}} props */
export function TargetForm({ upload, experiments, leave }) {
  const able = experiments.filter(({ footage }) => footage.includes(upload.kind));
  const { name, kind, frames, width, height, frame_rate_hz: rate, warnings } = upload;
  const content = WITHOUT_PICTURES[kind] ?? ` of ${width} × ${height} px at ${Number(rate.toPrecision(4))} Hz`;
  const cancel = html`<button type="button" onClick=${leave}>Cancel</button>`;
  const nothing = html`<p class="wrong" role="alert">No experiment takes a recording of this kind.</p>`;
  return html`<section class="target" aria-label="Target">
    <header>
      <h2>${kind === DONE ? "Results of another tracker" : "What should be tracked?"}</h2>
      <p class="hint">${name}, ${count(frames, "frame")}${content}</p>
      ${warnings.map((warning) => html`<p class="note">${warning}</p>`)}
    </header>
    ${able.length > 0 ? h(Form, { upload, able, cancel }) : [nothing, html`<footer>${cancel}</footer>`]}
  </section>`;
}

/** @param {{upload: UploadPublic, able: ExperimentPublic[], cancel: Child}} props `able`: experiments that take this kind of recording. */
function Form({ upload, able, cancel }) {
  const chosen = useSignal(/** @type {Target|null} */ (null));
  /** Aborted once a person has changed anything, so that nothing is chosen automatically any more. */
  const proposing = useMemo(() => new AbortController(), []);
  useEffect(() => {
    const first = new Target(upload, able.find(({ finds }) => finds === null) ?? able[0]);
    chosen.value = first;
    propose(first, able, proposing.signal).then((proposed) => (chosen.value = proposed ?? chosen.value));
    return () => {
      proposing.abort();
      chosen.value?.leave();
    };
  }, []);
  const target = chosen.value;
  useEffect(() => target?.way.value?.editor.focus(), [target !== null]);
  if (target === null) return null;
  const { frame, experiment } = target;
  const begin = (/** @type {InputEvent} */ { currentTarget }) => target.go(currentTarget.valueAsNumber);
  const settle = () => experiment.finds !== null && target.find({ alone: true });
  const options = able.map(({ id, clip_title: words }) => ({ value: id, words }));
  const follow = (/** @type {string} */ id) => (chosen.value = target.as(able.find((each) => each.id === id) ?? experiment));
  const submit = (/** @type {Event} */ event) => {
    event.preventDefault();
    target.start();
  };
  return html`<form onInput=${() => proposing.abort()} onSubmit=${submit}>
    ${h(Stage, { key: experiment.id, target })}
    <div class="target-choices">
      ${experiment.suits && h(Suitability, { key: experiment.id, target })}
      ${able.length > 1 && html`
        <label for="target-experiment">Follow it as</label>
        ${h(Select, { id: "target-experiment", label: "Follow it as", options, value: experiment.id, choose: follow })}
        <p class="note" role="status" hidden=${target.proposal === ""}>${target.proposal}</p>
      `}
      <label for="target-start">Start at picture <output>${frame.value} of ${upload.frames}, frame 0 of the session</output></label>
      <input type="range" id="target-start" min="0" max=${Math.max(0, upload.frames - 1)} step="1" value=${frame.value} onInput=${begin} onChange=${settle} />
      ${h(Tracker, { key: experiment.id, target })}
      ${experiment.truth_columns.length > 0 && h(Truth, { key: experiment.id, target })}
      ${h(Go, { target, cancel })}
    </div>
  </form>`;
}

/** Search with the experiments' own finders, while the form is already usable, and propose an experiment that finds its target.
 *
 * @param {Target} first The proposal until then.
 * @param {ExperimentPublic[]} able
 * @param {AbortSignal} ended
 */
async function propose(first, able, ended) {
  for (const experiment of able.filter((each) => each.finds !== null && each !== first.experiment)) {
    const sighting = await request("GET uploads/{upload}/mark", { upload: first.upload.id, experiment: experiment.id, frame: 0, last: 0 }).catch(() => null);
    if (ended.aborted || first.footage.value) return null;
    const words = `There is a ${experiment.target} in the picture. To follow something else, choose it above.`;
    if (sighting?.mark) return first.as(experiment, words);
  }
  return null;
}

/** @param {{target: Target}} props The picture with the target's mark. */
function Stage({ target }) {
  const { experiment: { finds, marks, advice, unmarked }, upload, picture } = target;
  const way = target.way.value;
  const known = target.finding.value;
  const kinds = marks.map(({ kind, title }) => ({ value: kind, words: title }));
  const isAsked = known?.state === "marking";
  useEffect(() => void (isAsked && way?.editor.focus()), [isAsked]);
  return html`<div class="target-stage">
    ${finds === null && marks.length > 1 && html`<label class="mark-choice">
      Mark the target by
      ${h(Select, { label: "Mark the target by", options: kinds, value: way?.description.kind ?? "", choose: (kind) => target.markBy(kind) })}
    </label>`}
    ${finds === null && html`<p class="hint">
      ${way?.description.instruction} ${advice} ${way && unmarked.includes(upload.kind) && "Leave them unchanged if the whole recording is the target."}
    </p>`}
    ${way
      ? h(Made, { key: way.description.kind, make: () => way.editor.element })
      : html`<img class="target-picture" alt="The frame to begin with" src=${picture.value} width=${upload.width} height=${upload.height} />`}
    ${finds !== null && html`<div class="finding">${known && h(known.state === "looking" ? Looking : Finding, { target, finding: known })}</div>`}
  </div>`;
}

/** @param {{target: Target, finding: FindingState}} props The progress of the search for the target, and its buttons. */
function Finding({ target, finding }) {
  const { experiment, found, hint, way, mark, left } = target;
  const { state, notes } = finding;
  const it = `the ${found?.title.toLowerCase()}`;
  const [byHand, byPerson] = hint
    ? [`Draw a ${hint.title.toLowerCase()}`, `Mark the ${experiment.target} by a ${hint.title.toLowerCase()}`]
    : [`Mark ${it}`, `Mark ${it} yourself`];
  const isHinting = way.value?.description === hint;
  const tool = (/** @type {string} */ label, /** @type {() => unknown} */ run, isMain = false) =>
    html`<button type="button" class=${isMain ? "primary" : null} onClick=${run}>${label}</button>`;
  const keys = html`<span class="by-keyboard">, or Tab to it and use the arrows, with shift for 10 px</span>`;
  const words = {
    looking: "",
    found: ["Drag a point to its correct position", keys, ". ", finding.isGuessed && "Hollow points were placed by the model; check them first. "],
    refused: `${byPerson}, or choose another frame. `,
    marking: [way.value?.description.instruction, " ", left.value > 0 && !isHinting && `Points that are still to be dragged: ${left.value}. `],
  }[state];
  const markBy = () => target.markBy((hint ?? found)?.kind);
  return html`
    ${state === "refused" ? html`<p class="wrong" role="alert">${notes.join(" ")}</p>` : notes.map((note) => html`<p class="note">${note}</p>`)}
    <p class="hint" role="status">${words}${!isHinting && experiment.advice}</p>
    <div class="finding-tools">
      ${state === "refused" && tool(`${byHand}…`, markBy, true)}
      ${state === "refused" && finding.hasLater && tool("Search later frames", () => target.find())}
      ${isHinting && mark.value && tool(`Place ${it}`, () => target.place(), true)}
      ${tool("Find again", () => target.find({ alone: true }))}
      ${state === "found" && hint && tool(`${byHand} instead…`, markBy)}
    </div>
  `;
}

/** @param {{target: Target, finding: FindingState}} props */
function Looking({ target, finding: { notes: [words], share } }) {
  return html`<div class="late finding">
    <p class="hint" role="status">${words}</p>
    ${h(Meter, { share, label: words })}
    <button type="button" onClick=${() => target.stop()}>Stop</button>
  </div>`;
}

/** @param {{target: Target}} props The judgement of a target, once its mark rests. */
function Suitability({ target }) {
  const { upload, footage } = target;
  /** The judgement, or why there is none. */
  const known = useSignal(/** @type {SuitabilityPublic|string|null} */ (null));
  /** Whether the answer for the present mark takes long. */
  const isLate = useSignal(false);
  const end = useRef(new AbortController());
  const { mark, start } = footage.value ?? {};
  const settle = (/** @type {typeof known.value} */ answer) => {
    end.current.abort();
    isLate.value = false;
    known.value = answer;
  };
  useEffect(() => {
    const { signal } = (end.current = new AbortController());
    const look = async (/** @type {Mark} */ about) => {
      later(() => (isLate.value = true), SLOW_MS, signal);
      const question = { ...target.ids, frame: Number(start), mark: JSON.stringify(about), signal };
      const answer = await request("GET uploads/{upload}/suitability", question).catch(messageOf);
      if (!signal.aborted) settle(answer);
    };
    if (mark) later(() => look(mark), STILL_MS, signal);
    else settle(null);
    return () => end.current.abort();
  }, [JSON.stringify(mark), start]);
  const found = known.value === null || typeof known.value === "string" ? null : known.value;
  const late = isLate.value && html`
    <p class="hint">${CHECKING}</p>
    <progress aria-label=${CHECKING}></progress>
    <button type="button" onClick=${() => settle(null)}>Stop</button>
  `;
  // The last picture stays until there is a new one, so that nothing jumps.
  return html`<section class=${late ? "suits stale" : "suits"} aria-label="Can it be tracked?">
    ${found?.picture && html`
      <img class="suits-picture" alt=${`Likelihood over the picture. ${found.remark}`} src=${found.picture} width=${upload.width} height=${upload.height} />
      <p class="suits-key hint">Likelihood <span>low</span><span class="suits-ramp" style=${RAMP}></span><span>high</span></p>
    `}
    <div class="suits-words" role="status" data-grade=${late || !found ? "" : found.grade}>
      ${late || h(SuitabilityWords, { known: known.value, take: (better) => target.take(better) })}
    </div>
  </section>`;
}

/** @param {{known: SuitabilityPublic|string|null, take: (mark: Mark) => void}} props `take` is called when a person takes the proposed
 * better mark. */
function SuitabilityWords({ known, take }) {
  if (known === null) return html`<p class="hint">Mark the target to see whether it can be tracked.</p>`;
  if (typeof known === "string") return html`<p class="wrong" role="alert">${known}</p>`;
  const { remark, advice, better } = known;
  return html`
    <p class="suits-remark">${remark}</p>
    ${advice.map((said) => html`<p class="hint">${said}</p>`)}
    ${better && html`<button type="button" data-role="better" onClick=${() => take(better)}>Use the proposed mark</button>`}
  `;
}

/** @param {{target: Target}} props The choice of the tracker. */
function Tracker({ target: { tracker, experiment: { trackers } } }) {
  const options = trackers.map(({ id, title }) => ({ value: id, words: title }));
  return html`
    <label for="target-tracker">Tracker</label>
    ${h(Select, { id: "target-tracker", label: "Tracker", options, value: tracker.value, choose: (id) => (tracker.value = id) })}
    <p class="hint">${trackers.find(({ id }) => id === tracker.value)?.description}</p>
  `;
}

/** @param {{target: Target}} props The upload's truth table, which the server stores until it is removed. */
function Truth({ target }) {
  const field = useRef(/** @type {HTMLElement|null} */ (null));
  const { kept, refused, isBusy } = target.truth.value;
  useEffect(() => void target.findTruth(), []);
  // The field is at the end of a scrolling form: scroll to the whole refusal.
  useEffect(() => void (refused && field.current?.scrollIntoView({ block: "nearest" })), [refused]);
  const give = (/** @type {InputEvent} */ { currentTarget: input }) => {
    target.giveTruth([...(input.files ?? [])]);
    input.value = "";
  };
  const columns = `With the columns ${target.experiment.truth_columns.join(", ")}; frames count from\u00a00`;
  const known = kept ? `Truth of ${count(kept.frames, "frame")}, ${kept.first} to ${kept.last}` : columns;
  return html`<div class="target-truth" ref=${field}>
    <label for="target-truth">Truth (CSV, optional)</label>
    <input type="file" id="target-truth" accept=${TRUTH_FILES} aria-describedby="target-truth-words" aria-invalid=${String(refused !== "")} onChange=${give} />
    <p class=${refused ? "wrong" : "hint"} role=${refused ? "alert" : null} id="target-truth-words">${refused || (isBusy ? "Checking the table" : known)}</p>
    ${kept && html`<button type="button" class="quiet" aria-label="Remove the truth" onClick=${() => target.removeTruth()}>Remove</button>`}
    ${kept?.warnings.map((warning) => html`<p class="note">${warning}</p>`)}
  </div>`;
}

/** @param {{target: Target, cancel: Child}} props The start button, enabled once the form is complete. */
function Go({ target: { upload, footage, truth, wrong, isStarting }, cancel }) {
  const { isBusy, refused } = truth.value;
  const isReady = footage.value !== null && !isBusy && !isStarting.value;
  useEffect(() => void (wrong.value = ""), [footage.value, truth.value]);
  const words = upload.kind === DONE ? "Open it" : "Track it";
  return html`
    ${wrong.value && html`<p class="wrong" role="alert">${wrong.value}</p>`}
    <footer>
      ${cancel}
      <button type="submit" class="primary" disabled=${!isReady}>${refused ? `${words} without truth` : words}</button>
    </footer>
  `;
}
