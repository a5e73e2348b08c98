/**
 * Truth of a recording: given as a table, or marked in its pictures.
 * For marking, the bare picture of the recording replaces the scene, and a person marks the target every few frames. The tracker's belief
 is hidden meanwhile, so that it does not influence the person. Frames between marked ones stay without truth: an interpolated place would
 be a guess, and would count as an error of the tracker if it were wrong. The run moves along, so that all its controls work here too. */

import { addressOf, formOf, request } from "../shared/api.js";
import { confirmLoss } from "../shared/dialog.js";
import { attempt, toast } from "../shared/dom.js";
import { count } from "../shared/format.js";
import { markEditor } from "../shared/marks/mark_editor.js";
import { markOf, valueAt } from "../shared/marks/mark_json.js";
import { Doing, Made } from "../shared/page.js";
import { follow } from "../shared/timing.js";
import { computed, h, html, signal, useEffect } from "../vendor/preact.js";
import { readTable, tableText } from "./truth_table.js";

/** @import { Mark } from "../shared/marks/mark_json.js" */
/** @import { TruthMark } from "../shared/messages.js" */
/** @import { Mounted } from "./mount.js" */
/** @import { Rows } from "./truth_table.js" */

/** Measure a run by a truth table, in place of an earlier one.
 *
 * @param {string} session
 * @param {File[]} files
 * @returns {Promise<boolean>} Whether the server accepted it.
 */
export async function giveTruth(session, files) {
  const told = await attempt(() => request("PUT sessions/{session}/truth", { session, body: formOf(files) }));
  if (told === undefined) return false;
  const known = `The truth of ${count(told.frames, "frame")} is known; the run is measured by it`;
  toast([known, ...told.warnings].join(". "));
  return true;
}

const EVERY = 5;
/** Largest movement of the pointer for a click, px. */
const CLICK_PX = 4;

/** Let a person mark the truth, starting from the known one; nothing happens if it cannot be marked in pictures.
 *
 * @param {Mounted} view
 */
export async function markTruth(view) {
  if (!view.store.isSteerable || view.scene === null || document.querySelector(".truth-marking")) return;
  const { upload, recipe, truth_mark: kind } = view.store.known;
  if (upload === null || kind === null) return;
  await attempt(async () => {
    await view.steering.pause();
    const about = { upload, experiment: recipe.experiment };
    const isKnown = (await request("GET uploads/{upload}/truth", about)) !== null;
    const text = isKnown ? await request("GET uploads/{upload}/truth.csv", about) : "";
    if (view.signal.aborted) return;
    const marking = new Marking(view, upload, kind, readTable(text));
    view.laid.value = h(TruthMarking, { marking, leave: () => (view.laid.value = null) });
  });
}

/** The marks as signals, and the actions on them. A moved mark is stored at once, and undone as one step. */
class Marking {
  /** The marks made here, the newest last, with the frame's earlier truth and proposal. */
  done = signal(/** @type {{frame: number, before: number[]|undefined, last: Mark|null}[]} */ ([]));
  /** The mark proposed for a frame without one. */
  last = signal(/** @type {Mark|null} */ (null));
  every = signal(EVERY);
  #view;
  #upload;
  #kind;
  /** Whether the frame was marked since it was shown. */
  #isTouched = false;

  /**
   * @param {Mounted} view
   * @param {string} upload
   * @param {TruthMark} kind
   * @param {Rows} known The known marks.
   */
  constructor(view, upload, kind, known) {
    this.#view = view;
    this.#upload = upload;
    this.#kind = kind;
    this.rows = signal(known);
    const { recipe, target } = view.store.known;
    const begun = recipe.footage?.mark;
    if (begun?.kind === kind.editor.kind) this.last.value = begun;
    this.editor = markEditor(kind.editor, target, () => this.#take());
  }

  get #first() {
    return this.#view.store.known.recipe.footage?.start ?? 0;
  }

  /** Number of the picture in the recording; it does not change when a seek arrives at its frame. */
  frame = computed(() => this.#first + this.#view.steering.frame);

  /** Show the picture of the run's present or target frame, with its mark, or the last one as a proposal. */
  show() {
    const { width, height } = this.#view.store.known;
    const values = this.rows.peek().get(this.frame.value);
    const { parts, editor } = this.#kind;
    this.#isTouched = false;
    this.editor.picture.show(addressOf("GET uploads/{upload}/frames/{frame}.jpg", { upload: this.#upload, frame: this.frame.value }), width, height);
    this.editor.set(values === undefined ? this.last.peek() : markOf(editor.kind, parts.map((part, place) => [part, values[place]])));
  }

  /** Store the mark as the truth of this frame, if it is complete. */
  #take() {
    const { mark } = this.editor;
    const values = this.#kind.parts.map((part) => valueAt(mark, part)).filter((value) => typeof value === "number");
    if (values.length < this.#kind.parts.length) return false;
    this.#put(values);
    this.last.value = mark;
    return true;
  }

  /** @param {number[]} [values] Left out for a frame without truth. */
  #put(values) {
    const frame = this.frame.value;
    const step = { frame, before: this.rows.value.get(frame), last: this.last.value };
    if (!this.#isTouched) this.done.value = [...this.done.value, step];
    this.#isTouched = true;
    this.#set(frame, values);
  }

  /**
   * @param {number} frame
   * @param {number[]|undefined} values
   */
  #set(frame, values) {
    const others = [...this.rows.value].filter(([other]) => other !== frame);
    this.rows.value = new Map(values === undefined ? others : [...others, [frame, values]]);
  }

  keep() {
    if (this.#take()) this.step(1);
  }

  /** Note that the target is not visible in this frame. */
  skip() {
    this.#put();
    this.step(1);
  }

  /** Undo the last step, and go to its frame. */
  undo() {
    const newest = this.done.value.at(-1);
    if (newest === undefined) return;
    this.done.value = this.done.value.slice(0, -1);
    this.#set(newest.frame, newest.before);
    this.last.value = newest.last;
    if (newest.frame === this.frame.value) this.show();
    this.#go(newest.frame);
  }

  /** @param {number} direction */
  step(direction) {
    this.#go(this.frame.value + direction * Math.max(1, Math.round(this.every.value) || EVERY));
  }

  /** @param {number} frame */
  #go(frame) {
    if (frame !== this.frame.value) this.#view.steering.seek(frame - this.#first);
    this.editor.focus();
  }

  /** @returns {Promise<boolean>} Whether the marks were taken. */
  give() {
    const { id, truth_columns: columns } = this.#view.store.known;
    return giveTruth(id, [new File([tableText(columns, this.rows.value)], "truth.csv", { type: "text/csv" })]);
  }
}

/** @param {{marking: Marking, leave: () => void}} props */
function TruthMarking({ marking, leave }) {
  const { rows, done, editor, every, last } = marking;
  useEffect(() => {
    const end = new AbortController();
    follow(() => marking.frame.value, () => marking.show(), end.signal);
    editor.focus();
    return () => end.abort();
  }, []);
  const frame = marking.frame.value;
  const hasNone = done.value.length === 0;
  const isKept = rows.value.has(frame);
  const clicked = editor.centre ? "Click the target: the mark goes there, and the next frame appears. Or " : "";
  const by = clicked ? "drag a new one or move it by the arrows, and press Enter" : "Move it by mouse or by the arrows, and press Enter";
  const setEvery = (/** @type {Event & {currentTarget: HTMLInputElement}} */ { currentTarget }) => (every.value = currentTarget.valueAsNumber);
  const cancel = async () => {
    const text = `${count(done.value.length, "change")} of the truth would be lost.`;
    if (hasNone || (await confirmLoss({ title: "Leave without the marks?", text, action: "Leave" }))) leave();
    else editor.focus();
  };
  const give = async () => (await marking.give()) && leave();
  const press = (/** @type {KeyboardEvent} */ event) => {
    const isWithin = event.target instanceof Node && editor.element.contains(event.target);
    const within = { Enter: () => marking.keep(), Backspace: () => marking.undo(), Delete: () => marking.skip() };
    const act = /** @type {Record<string, () => void>} */ ({ Escape: cancel, ...(isWithin && within) })[event.key];
    if (act === undefined) return;
    event.preventDefault();
    event.stopPropagation();
    act();
  };
  return html`<section class="truth-marking" aria-label="Mark truth" data-state=${isKept ? "kept" : "proposed"} onKeyDown=${press}>
    <div class="truth-stage">${h(Made, { make: () => clickable(marking) })}</div>
    <div class="truth-tools">
      <p class="truth-state" role="status">Picture ${frame} is ${isKept ? "marked" : "not marked"}. ${count(rows.value.size, "frame")} marked.</p>
      <p class="hint">${clicked}${by}. Frames in between stay without truth and do not count.</p>
      <div class="truth-row">
        <label>Every <input type="number" id="truth-every" min="1" max="1000" step="1" value=${every.value} onInput=${setEvery} /> frames</label>
        <button type="button" onClick=${() => marking.step(-1)}>Back</button>
        <button type="button" disabled=${hasNone} onClick=${() => marking.undo()}>Undo</button>
        <button type="button" onClick=${() => marking.skip()}>Not in the picture</button>
        <button type="button" class="primary" disabled=${!isKept && last.value === null} onClick=${() => marking.keep()}>Save and continue</button>
        <span class="spring"></span>
        <button type="button" onClick=${cancel}>Cancel</button>
        ${h(Doing, { label: "Done", class: "primary", disabled: hasNone || rows.value.size === 0, run: give })}
      </div>
    </div>
  </section>`;
}

/** The editor of a mark, in which a click marks the target and shows the next frame.
 *
 * @param {Marking} marking
 */
function clickable(marking) {
  const { element: surface } = marking.editor;
  let pressed = { x: NaN, y: NaN };
  surface.addEventListener("pointerdown", ({ button, clientX: x, clientY: y }) => (pressed = button === 0 ? { x, y } : { x: NaN, y: NaN }));
  surface.addEventListener("pointerup", (event) => {
    if (Math.hypot(event.clientX - pressed.x, event.clientY - pressed.y) < CLICK_PX && marking.editor.centre?.(event)) marking.keep();
  });
  return surface;
}
