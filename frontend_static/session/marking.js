/**
 * Truth of a recording: given as a table, or marked in its pictures.
 *
 * For marking, the bare picture of the recording stands in the place of the scene, in which a person marks the target, every so
 * many frames. What the tracker believes is out of sight meanwhile, so that nobody is led by it. Frames between marked ones
 * stay without truth: a place between two marks would be a guess, and count as an error of the tracker where it is wrong.
 * The run goes along, so that all that moves through it moves here too.
 */

import { addressOf, formOf, request } from "../shared/api.js";
import { confirmLoss } from "../shared/dialog.js";
import { attempt, build, toast } from "../shared/dom.js";
import { count } from "../shared/format.js";
import { markEditor } from "../shared/marks/mark_editor.js";
import { markOf, valueAt } from "../shared/marks/mark_json.js";
import { Made } from "../shared/page.js";
import { h, html, render, signal, useEffect, useSignalEffect } from "../vendor/preact.js";
import { readTable, tableText } from "./truth_table.js";

/** @import { Mark } from "../shared/marks/mark_json.js" */
/** @import { TruthMark } from "../shared/messages.js" */
/** @import { Mounted } from "./mount.js" */
/** @import { Rows } from "./truth_table.js" */

/**
 * Have a run measured by a table of truth, in place of one that was given before.
 *
 * @param {string} session
 * @param {File[]} files
 * @returns {Promise<boolean>} Whether it was taken.
 */
export async function giveTruth(session, files) {
  const told = await attempt(() => request("PUT sessions/{session}/truth", { session, body: formOf(files) }));
  if (told === undefined) return false;
  const known = `The truth of ${count(told.frames, "frame")} is known; the run is measured by it`;
  toast([known, ...told.warnings].join(". "));
  return true;
}

const EVERY = 5;
/** A pointer that has moved less has clicked, px. */
const CLICK_PX = 4;

/**
 * Have truth marked, beginning with what is known already; nothing where it cannot be marked in pictures.
 *
 * @param {Mounted} view
 */
export async function markTruth(view) {
  if (!view.able || view.scene === null || document.querySelector(".truth-marking")) return;
  const { upload, recipe, truth_mark: kind } = view.store.known;
  if (upload === null || kind === null) return;
  await attempt(async () => {
    await view.steering.pause();
    const rows = await knownRows(upload, recipe.experiment);
    if (!view.signal.aborted) begin(view, upload, kind, rows);
  });
}

/**
 * @param {string} upload
 * @param {string} experiment
 * @returns {Promise<Rows>}
 */
async function knownRows(upload, experiment) {
  if ((await request("GET uploads/{upload}/truth", { upload, experiment })) === null) return new Map();
  return readTable(await request("GET uploads/{upload}/truth.csv", { upload, experiment }));
}

/**
 * @param {Mounted} view
 * @param {string} upload
 * @param {TruthMark} kind
 * @param {Rows} known
 */
function begin(view, upload, kind, known) {
  const place = build("div", { class: "made" });
  const leave = () => {
    render(null, place);
    place.remove();
  };
  view.scene?.lay(place);
  view.signal.addEventListener("abort", leave);
  render(h(TruthMarking, { marking: new Marking(view, kind, known, leave), upload }), place);
}

/** What is marked, as signals, and what can be done to it. */
class Marking {
  /** What was marked here, the newest last, with what was known of the frame before. */
  done = signal(/** @type {{frame: number, before: number[]|undefined}[]} */ ([]));
  mark = signal(/** @type {Mark|null} */ (null));
  every = signal(EVERY);
  isGiving = signal(false);
  #view;
  #kind;
  /**
   * The mark from which that of a frame begins which has none.
   *
   * @type {Mark|null}
   */
  #last = null;

  /**
   * @param {Mounted} view
   * @param {TruthMark} kind
   * @param {Rows} known What was marked before.
   * @param {() => void} leave
   */
  constructor(view, kind, known, leave) {
    this.#view = view;
    this.#kind = kind;
    this.leave = leave;
    this.rows = signal(known);
    const { recipe, target } = view.store.known;
    const begun = recipe.footage?.mark;
    if (begun?.kind === kind.editor.kind) this.#last = begun;
    this.editor = markEditor(kind.editor, target, () => (this.mark.value = this.editor.mark));
  }

  get #first() {
    return this.#view.store.known.recipe.footage?.start ?? 0;
  }

  /** Number of the picture in the recording. */
  get frame() {
    return this.#first + this.#view.store.known.position;
  }

  /** Whether the mark is that of the frame. */
  get isKept() {
    const values = this.rows.value.get(this.frame);
    return values !== undefined && valuesOf(this.#kind, this.mark.value)?.join() === values.join();
  }

  /**
   * The picture where the run stands, with its mark, or with the last one as a proposal.
   *
   * @param {string} upload
   */
  show(upload) {
    const { width, height } = this.#view.store.known;
    const values = this.rows.value.get(this.frame);
    const { parts, editor } = this.#kind;
    this.editor.show(addressOf("GET uploads/{upload}/frames/{frame}.jpg", { upload, frame: this.frame }), width, height);
    this.editor.set(values === undefined ? this.#last : markOf(editor.kind, parts.map((part, place) => [part, values[place]])));
    this.mark.value = this.editor.mark;
  }

  /** The mark is true of this frame; go on. */
  keep() {
    const values = valuesOf(this.#kind, this.editor.mark);
    if (values === null) return;
    this.#last = this.editor.mark;
    this.put(values);
  }

  /** @param {number[]} [values] Left out where the frame has no truth, as when the target is hidden. Goes on. */
  put(values) {
    const { frame } = this;
    this.done.value = [...this.done.value, { frame, before: this.rows.value.get(frame) }];
    this.rows.value = withRow(this.rows.value, frame, values);
    this.step(1);
  }

  /** Take back what was done last, and stand where that was. */
  undo() {
    const newest = this.done.value.at(-1);
    if (newest === undefined) return;
    this.done.value = this.done.value.slice(0, -1);
    this.rows.value = withRow(this.rows.value, newest.frame, newest.before);
    this.#go(newest.frame);
  }

  /** @param {number} direction */
  step(direction) {
    this.#go(this.frame + direction * Math.max(1, Math.round(this.every.value) || EVERY));
  }

  /** @param {number} frame */
  #go(frame) {
    if (frame !== this.frame) this.#view.steering.seek(frame - this.#first);
    this.editor.focus();
  }

  async cancel() {
    const text = `${count(this.done.value.length, "change")} of the truth would be lost.`;
    if (this.done.value.length === 0 || (await confirmLoss({ title: "Leave without the marks?", text, action: "Leave" }))) this.leave();
    else this.editor.focus();
  }

  async give() {
    const { id, truth_columns: columns } = this.#view.store.known;
    this.isGiving.value = true;
    const table = new File([tableText(columns, this.rows.value)], "truth.csv", { type: "text/csv" });
    if (await giveTruth(id, [table])) this.leave();
    this.isGiving.value = false;
  }

  /** @param {KeyboardEvent} event */
  press(event) {
    const isWithin = event.target instanceof Node && this.editor.element.contains(event.target);
    const within = { Enter: () => this.keep(), Backspace: () => this.undo(), Delete: () => this.put() };
    const actions = { Escape: () => this.cancel(), ...(isWithin && within) };
    const action = /** @type {Record<string, () => void>} */ (actions)[event.key];
    if (action === undefined) return;
    event.preventDefault();
    event.stopPropagation();
    action();
  }
}

/** @param {{marking: Marking, upload: string}} props */
function TruthMarking({ marking, upload }) {
  const { frame, rows, done, editor, every } = marking;
  useSignalEffect(() => marking.show(upload));
  useEffect(() => editor.focus(), []);
  const changed = rows.value.has(frame) ? "changed" : "not marked";
  const state = marking.isKept ? "marked" : changed;
  const clicked = editor.centre ? "Click the target: the mark goes there, and the next frame comes. Or " : "";
  const by = clicked ? "drag a new one or move it by the arrows, and press Enter" : "Move it by mouse or by the arrows, and press Enter";
  const setEvery = (/** @type {Event & {currentTarget: HTMLInputElement}} */ { currentTarget }) => (every.value = currentTarget.valueAsNumber);
  const hasNone = done.value.length === 0;
  const keep = html`<button type="button" class="primary" disabled=${marking.mark.value === null} onClick=${() => marking.keep()}>Keep and go on</button>`;
  const isOff = marking.isGiving.value || hasNone || rows.value.size === 0;
  const press = (/** @type {KeyboardEvent} */ event) => marking.press(event);
  return html`<section class="truth-marking" aria-label="Mark truth" data-state=${marking.isKept ? "kept" : "proposed"} onKeyDown=${press}>
    <div class="truth-stage">${h(Made, { make: () => clickable(marking) })}</div>
    <div class="truth-tools">
      <p class="truth-state" role="status">Picture ${frame} is ${state}. ${count(rows.value.size, "frame")} marked.</p>
      <p class="hint">${clicked}${by}. Frames in between stay without truth: they count neither for the tracker nor against it.</p>
      <div class="truth-row">
        <label>Every <input type="number" id="truth-every" min="1" max="1000" step="1" value=${every.value} onInput=${setEvery} /> frames</label>
        <button type="button" onClick=${() => marking.step(-1)}>Back</button>
        <button type="button" disabled=${hasNone} onClick=${() => marking.undo()}>Undo</button>
        <button type="button" onClick=${() => marking.put()}>Not in the picture</button>
        ${keep}
        <span class="spring"></span>
        <button type="button" onClick=${() => marking.cancel()}>Cancel</button>
        <button type="button" class="primary" disabled=${isOff} onClick=${() => marking.give()}>Done</button>
      </div>
    </div>
  </section>`;
}

/**
 * The editor of a mark, on which a click marks the target and goes on.
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

/**
 * @param {Rows} rows
 * @param {number} frame
 * @param {number[]|undefined} values
 * @returns {Rows}
 */
function withRow(rows, frame, values) {
  const next = new Map(rows);
  if (values === undefined) next.delete(frame);
  else next.set(frame, values);
  return next;
}

/**
 * The values of a table's row, in the order of its columns; null where the mark lacks one.
 *
 * @param {TruthMark} kind
 * @param {Mark|null} mark
 */
function valuesOf({ parts }, mark) {
  const values = parts.map((part) => valueAt(mark, part)).filter((value) => typeof value === "number");
  return values.length === parts.length ? values : null;
}
