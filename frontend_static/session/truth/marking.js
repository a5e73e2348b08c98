/**
 * Marking truth: in the place of the scene the bare picture of the recording, in which a person marks the target, every so
 * many frames. What the tracker believes is out of sight meanwhile, so that nobody is led by it. Frames between marked ones
 * stay without truth: a place between two marks would be a guess, and count as an error of the tracker where it is wrong.
 *
 * The run goes along, so that all that moves through it moves here too. The table that comes of it is given like a file.
 */

import { api } from "../../shared/api.js";
import { confirmLoss } from "../../shared/dialog.js";
import { h, setText } from "../../shared/dom.js";
import { count } from "../../shared/format.js";
import { markEditor } from "../../shared/marks/mark_editor.js";
import { markOf, valueAt } from "../../shared/marks/mark_json.js";
import { attempt } from "../../shared/toast.js";
import { giveTruth } from "./give_truth.js";
import { readTable, tableText } from "./truth_table.js";

/** @import { Mark } from "../../shared/marks/mark_json.js" */
/** @import { Mounted } from "../mount.js" */
/** @import { TruthMark } from "../../shared/messages.js" */
/** @import { Rows } from "./truth_table.js" */

const EVERY = 5;
/** A pointer that has moved less has clicked, px. */
const CLICK_PX = 4;

/**
 * Whether truth can be marked in a session's pictures here.
 *
 * @param {Mounted} view
 */
export function canMarkTruth({ store, scene, able }) {
  const { session } = store;
  return able && scene !== null && session !== null && session.upload !== null && session.truth_mark !== null;
}

/**
 * Have truth marked, beginning with what is known already.
 *
 * @param {Mounted} view
 */
export async function markTruth(view) {
  if (!canMarkTruth(view) || document.querySelector(".truth-marking")) return;
  const { upload, recipe, truth_mark: kind } = view.store.known;
  if (upload === null || !kind) return;
  await attempt(async () => {
    await view.steering.pause();
    const rows = await knownRows(upload, recipe.experiment);
    if (!view.signal.aborted) new TruthMarking(view, upload, kind, rows).begin();
  });
}

/**
 * @param {string} upload
 * @param {string} experiment
 * @returns {Promise<Rows>}
 */
async function knownRows(upload, experiment) {
  if ((await api.truth(upload, experiment)) === null) return new Map();
  const { content } = await api.truthTable(upload, experiment);
  return readTable(await content.text());
}

class TruthMarking {
  /** @type {Mounted} */
  #view;
  /** @type {string} */
  #upload;
  /** @type {TruthMark} */
  #kind;
  /** @type {Rows} */
  #rows;
  /**
   * What was marked here, the newest last, with what was known of the frame before.
   *
   * @type {{frame: number, before: number[]|undefined}[]}
   */
  #done = [];
  /**
   * The mark from which that of a frame begins which has none.
   *
   * @type {Mark|null}
   */
  #last = null;
  #ended = new AbortController();
  /** @type {{x: number, y: number}|null} */
  #pressed = null;
  #editor;
  #state = h("p", { class: "truth-state", role: "status" });
  /** @type {HTMLInputElement} */
  #every = h("input", { type: "number", id: "truth-every", min: 1, max: 1000, step: 1, value: EVERY });
  #keep = this.#button("Keep and go on", () => this.keep(), "primary");
  #undo = this.#button("Undo", () => this.undo());
  #finish = this.#button("Done", () => this.#give(), "primary");
  #root;

  /**
   * @param {Mounted} view
   * @param {string} upload
   * @param {TruthMark} kind
   * @param {Rows} rows What is known already.
   */
  constructor(view, upload, kind, rows) {
    [this.#view, this.#upload, this.#kind, this.#rows] = [view, upload, kind, rows];
    const { recipe, target } = view.store.known;
    const begun = recipe.footage?.mark;
    if (begun?.kind === kind.editor.kind) this.#last = begun;
    this.#editor = markEditor(kind.editor, target, () => this.#tell());
    this.#root = h(
      "section",
      { class: "truth-marking", "aria-label": "Mark truth" },
      h("div", { class: "truth-stage" }, this.#editor.element),
      h(
        "div",
        { class: "truth-tools" },
        this.#state,
        h("p", { class: "hint" }, this.#instruction),
        h(
          "div",
          { class: "truth-row" },
          h("label", { for: "truth-every" }, "Every ", this.#every, " frames"),
          this.#button("Back", () => this.#go(-1)),
          this.#undo,
          this.#button("Not in the picture", () => this.leaveOut()),
          this.#keep,
          h("span", { class: "spring" }),
          this.#button("Cancel", () => this.cancel()),
          this.#finish,
        ),
      ),
    );
    this.#listen();
  }

  begin() {
    this.#view.scene?.lay(this.#root);
    this.#show();
    this.#editor.focus();
  }

  get #instruction() {
    const clicked = this.#editor.centre && "Click the target: the mark goes there, and the next frame comes. Or ";
    const by = clicked ? "drag a new one or move it by the arrows, and press Enter" : "Move it by mouse or by the arrows, and press Enter";
    return [clicked, by, ". Frames in between stay without truth: they count neither for the tracker nor against it."];
  }

  /** Number of the picture in the recording. */
  get #frame() {
    const { recipe, position } = this.#view.store.known;
    return (recipe.footage?.start ?? 0) + position;
  }

  #listen() {
    const { signal } = this.#ended;
    this.#view.signal.addEventListener("abort", () => this.#leave(), { signal });
    let shown = -1;
    this.#view.store.on(["position", "session"], () => {
      if (signal.aborted || this.#view.store.session === null || shown === this.#frame) return;
      shown = this.#frame;
      this.#show();
    });
    this.#root.addEventListener("keydown", (event) => this.#key(event));
    const surface = this.#editor.element;
    surface.addEventListener("pointerdown", ({ button, clientX: x, clientY: y }) => (this.#pressed = button === 0 ? { x, y } : null));
    surface.addEventListener("pointerup", (event) => this.#release(event));
  }

  /** @param {PointerEvent} event */
  #release(event) {
    const pressed = this.#pressed;
    this.#pressed = null;
    if (pressed === null || Math.hypot(event.clientX - pressed.x, event.clientY - pressed.y) >= CLICK_PX) return;
    if (this.#editor.centre?.(event)) this.keep();
  }

  /** @param {KeyboardEvent} event */
  #key(event) {
    const action = this.#actionOf(event);
    if (action === null) return;
    event.preventDefault();
    event.stopPropagation();
    action();
  }

  /**
   * @param {KeyboardEvent} event
   * @returns {(() => void)|null}
   */
  #actionOf({ key, target }) {
    if (key === "Escape") return () => this.cancel();
    if (!(target instanceof Node && this.#editor.element.contains(target))) return null;
    if (key === "Enter") return () => this.keep();
    if (key === "Backspace") return () => this.undo();
    return key === "Delete" ? () => this.leaveOut() : null;
  }

  /** The picture where the run stands, with its mark, or with the last one as a proposal. */
  #show() {
    const { width, height } = this.#view.store.known;
    this.#editor.show(api.pictureAddress(this.#upload, this.#frame), width, height);
    const values = this.#rows.get(this.#frame);
    this.#editor.set(values === undefined ? this.#last : this.#markOf(values));
    this.#tell();
  }

  #tell() {
    const isMarked = this.#rows.has(this.#frame);
    const isKept = isMarked && this.#valuesOf(this.#editor.mark)?.join() === this.#rows.get(this.#frame)?.join();
    this.#root.dataset.state = isKept ? "kept" : "proposed";
    const changed = isMarked ? "changed" : "not marked";
    const words = isKept ? "marked" : changed;
    setText(this.#state, `Picture ${this.#frame} is ${words}. ${count(this.#rows.size, "frame")} marked.`);
    this.#keep.disabled = this.#editor.mark === null;
    this.#undo.disabled = this.#done.length === 0;
    this.#finish.disabled = this.#done.length === 0 || this.#rows.size === 0;
  }

  /** The mark is true of this frame; go on. */
  keep() {
    const { mark } = this.#editor;
    const values = this.#valuesOf(mark);
    if (mark === null || values === null) return;
    this.#last = mark;
    this.#put(values);
    this.#go(1);
  }

  /** There is no truth of this frame, as where the target is hidden; go on. */
  leaveOut() {
    this.#put(undefined);
    this.#go(1);
  }

  /** Take back what was done last, and stand where that was. */
  undo() {
    const last = this.#done.pop();
    if (last === undefined) return;
    this.#set(last.frame, last.before);
    const away = last.frame - this.#frame;
    if (away === 0) this.#show();
    else this.#view.steering.seek(this.#view.store.known.position + away);
    this.#editor.focus();
  }

  /** @param {number[]|undefined} values */
  #put(values) {
    const frame = this.#frame;
    this.#done.push({ frame, before: this.#rows.get(frame) });
    this.#set(frame, values);
    this.#tell();
  }

  /**
   * @param {number} frame
   * @param {number[]|undefined} values
   */
  #set(frame, values) {
    if (values === undefined) this.#rows.delete(frame);
    else this.#rows.set(frame, values);
  }

  /** @param {number} direction */
  #go(direction) {
    const every = Math.max(1, Math.round(this.#every.valueAsNumber) || EVERY);
    this.#view.steering.seek(this.#view.store.known.position + direction * every);
    this.#editor.focus();
  }

  async cancel() {
    const text = `${count(this.#done.length, "change")} of the truth would be lost.`;
    if (this.#done.length === 0 || (await confirmLoss({ title: "Leave without the marks?", text, action: "Leave" }))) this.#leave();
    else this.#editor.focus();
  }

  async #give() {
    const { id, truth_columns: columns } = this.#view.store.known;
    this.#finish.disabled = true;
    const table = new File([tableText(columns, this.#rows)], "truth.csv", { type: "text/csv" });
    if (await giveTruth(id, [table])) this.#leave();
    else this.#tell();
  }

  #leave() {
    this.#ended.abort();
    this.#root.remove();
  }

  /**
   * The values of a table's row, in the order of its columns; null where the mark lacks one.
   *
   * @param {Mark|null} mark
   */
  #valuesOf(mark) {
    const values = this.#kind.parts.map((part) => valueAt(mark, part)).filter((value) => typeof value === "number");
    return values.length === this.#kind.parts.length ? values : null;
  }

  /** @param {number[]} values */
  #markOf(values) {
    return markOf(this.#kind.editor.kind, this.#kind.parts.map((part, place) => [part, values[place]]));
  }

  /**
   * @param {string} words
   * @param {() => void} run
   * @param {string} [kind]
   */
  #button(words, run, kind) {
    return h("button", { type: "button", class: kind, on: { click: run } }, words);
  }
}
