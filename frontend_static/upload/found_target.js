/**
 * A target that is found by itself: looked for with progress, shown to be corrected, and, where nothing was found, placed
 * by a mark of another kind with which a person shows where it is; where there is no such kind, marked by that person.
 */

import { api, messageOf } from "../shared/api.js";
import { fill, h, setText } from "../shared/dom.js";
import { later } from "../shared/timing.js";
import { descriptionOf, markEditor } from "../shared/marks/mark_editor.js";

/** @import { Mark } from "../shared/marks/mark_json.js" */

/**
 * @typedef {import("../shared/messages.js").ExperimentPublic} ExperimentPublic
 * @typedef {import("../shared/messages.js").SightingPublic} SightingPublic
 * @typedef {import("../shared/messages.js").UploadPublic} UploadPublic
 */

/** @typedef {{changed: () => void, moved: (frame: number) => void}} Listener `moved`: the target was found in a later frame. */

const SLOW_MS = 200;

export class FoundTarget {
  /** @type {UploadPublic} */
  #upload;
  /** @type {ExperimentPublic} */
  #experiment;
  /** @type {Listener} */
  #on;
  #frame = 0;
  /** Ends what was asked for before: only the newest question is answered. */
  #outdated = new AbortController();
  #found;
  #editor;
  #hint;
  #hintEditor;
  /** What is still to be marked by hand. */
  #left = h("p", { class: "hint", role: "status" });
  #status = h("div", { class: "finding" });

  /**
   * @param {HTMLElement} root
   * @param {UploadPublic} upload
   * @param {ExperimentPublic} experiment
   * @param {Listener} on
   */
  constructor(root, upload, experiment, on) {
    [this.#upload, this.#experiment, this.#on] = [upload, experiment, on];
    const found = descriptionOf(experiment, experiment.finds);
    if (found === undefined) throw new Error(`${experiment.title} finds marks of a kind that it does not accept: ${experiment.finds}`);
    this.#found = found;
    this.#editor = markEditor(found, experiment.target, () => this.#edited());
    this.#hint = descriptionOf(experiment, experiment.hints[0]);
    this.#hintEditor = this.#hint && markEditor(this.#hint, experiment.target, () => this.#offerPlacing());
    fill(root, this.#editor.element, this.#hintEditor?.element, this.#status);
    this.#hinting(false);
  }

  /** What a session is told of the target, or null while there is nothing to tell. */
  get footage() {
    const { mark, left } = this.#editor;
    return mark && left === 0 ? { mark, start: this.#frame } : null;
  }

  /**
   * Show a frame; what was found in another one counts no more.
   *
   * @param {number} frame
   */
  show(frame) {
    this.leave();
    this.#frame = frame;
    const address = api.pictureAddress(this.#upload.id, frame);
    for (const editor of [this.#editor, this.#hintEditor]) editor?.show(address, this.#upload.width, this.#upload.height);
    this.#forget();
    fill(this.#status);
  }

  /** Look for the target from the frame that is shown on, or in that alone, since it is `nowhere` in the others. */
  async find({ alone = false, nowhere = false } = {}) {
    const frame = this.#frame;
    this.#forget();
    const question = { experiment: this.#experiment.id, frame, ...(alone && { last: frame }) };
    const sighting = await this.#ask(async (told) => {
      for (let looked = 0; ; ) {
        const answer = await api.mark(this.#upload.id, { ...question, looked });
        if (answer.mark || answer.looked >= answer.of) return answer;
        looked = answer.looked;
        if (!told(looked, answer.of)) return null;
      }
    });
    if (!sighting) return;
    if (sighting.mark) this.#take(sighting);
    // Of the frame that was asked for it is said why there is no target, or what may be one is shown.
    else if (!alone) await this.find({ alone: true, nowhere: true });
    else this.#refuse([...sighting.remarks, nowhere && "None was found in later frames either."], nowhere);
  }

  focus() {
    this.#editor.focus();
  }

  leave() {
    this.#outdated.abort();
  }

  /**
   * Take another mark in place of the one that is shown.
   *
   * @param {Mark} mark Of the kind that is found.
   */
  adopt(mark) {
    this.#hinting(false);
    this.#editor.set(mark);
    this.#on.changed();
  }

  /**
   * Await an answer with progress after a while; null if it is not wanted any more or was refused.
   *
   * @param {(told: (looked: number, of: number) => boolean) => Promise<SightingPublic|null>} question
   */
  async #ask(question) {
    this.leave();
    this.#outdated = new AbortController();
    const { signal } = this.#outdated;
    const looking = `Looking for a ${this.#experiment.target}`;
    const meter = h("progress", { max: 1, "aria-label": looking });
    const words = h("p", { class: "hint", role: "status" }, looking);
    const stop = () => {
      this.leave();
      this.#refuse(["The search was stopped."]);
    };
    fill(this.#status);
    const offer = () => fill(this.#status, words, meter, h("button", { type: "button", on: { click: stop } }, "Stop"));
    const settle = later(offer, SLOW_MS, signal);
    try {
      const answer = await question((looked, of) => {
        meter.value = looked / of;
        setText(words, `${looking}, ${looked} of ${of} frames`);
        return !signal.aborted;
      });
      return signal.aborted ? null : answer;
    } catch (error) {
      if (!signal.aborted) this.#refuse([messageOf(error)]);
      return null;
    } finally {
      settle();
    }
  }

  /** @param {SightingPublic} sighting */
  #take({ frame, mark, placed, remarks }) {
    const wanted = this.#frame;
    const isLater = frame !== wanted;
    if (isLater) {
      this.show(frame);
      this.#on.moved(frame);
    }
    this.#hinting(false);
    this.#editor.set(mark, placed);
    const notes = isLater ? [`Starting at picture ${wanted}, the first suitable ${this.#experiment.target} is in picture ${frame}.`, ...remarks] : remarks;
    const keys = h("span", { class: "by-keyboard" }, ", or Tab to it and use the arrows, with shift for 10 px");
    const hollow = placed.length > 0 && "Hollow points were placed by the model; check them first. ";
    fill(
      this.#status,
      notes.map((remark) => h("p", { class: "note" }, remark)),
      h("p", { class: "hint" }, "Drag a point to its correct position", keys, ". ", hollow, this.#experiment.advice),
      h("div", { class: "finding-tools" }, this.#tool("Find again", () => this.find({ alone: true })), this.#hintTool(" instead…")),
    );
    this.#on.changed();
  }

  /**
   * @param {(string|false)[]} remarks
   * @param {boolean} [nowhere]
   */
  #refuse(remarks, nowhere = false) {
    const hasLater = !nowhere && this.#frame < this.#upload.frames - 1;
    const way = this.#hint ? `Mark the ${this.#experiment.target} by a ${this.#hint.title.toLowerCase()}` : `${this.#byHand} yourself`;
    fill(
      this.#status,
      h("p", { class: "wrong", role: "alert" }, remarks.filter(Boolean).join(" ")),
      h(
        "div",
        { class: "finding-tools" },
        this.#hint ? this.#hintTool("…", true) : this.#tool(`${this.#byHand}…`, () => this.#markByHand(), true),
        hasLater && this.#tool("Look in later frames", () => this.find()),
        this.#tool("Try again", () => this.find({ alone: true })),
      ),
      h("p", { class: "hint" }, way, ", or choose another frame. ", this.#experiment.advice),
    );
    this.#on.changed();
  }

  get #byHand() {
    return `Mark the ${this.#found.title.toLowerCase()}`;
  }

  /** Have a person mark all of the target. */
  #markByHand() {
    this.leave();
    this.#forget();
    this.#editor.offer();
    const again = this.#tool("Find again", () => this.find({ alone: true }));
    const words = h("p", { class: "hint" }, this.#found.instruction, " ", this.#experiment.advice);
    fill(this.#status, words, this.#left, h("div", { class: "finding-tools" }, again));
    this.#edited();
    this.#editor.focus();
  }

  #edited() {
    const { left } = this.#editor;
    setText(this.#left, left > 0 ? `Points that are still to be dragged: ${left}` : "");
    this.#on.changed();
  }

  /** Have a person show where the target is. */
  #askForHint() {
    this.leave();
    this.#forget();
    this.#hinting(true);
    this.#hintEditor?.offer();
    const again = this.#tool("Find again", () => this.find({ alone: true }));
    fill(this.#status, h("p", { class: "hint" }, this.#hint?.instruction), h("div", { class: "finding-tools" }, again));
    this.#hintEditor?.focus();
  }

  #offerPlacing() {
    if (!this.#hintEditor?.mark || this.#hintEditor.element.hidden || this.#status.querySelector("[data-role=place]")) return;
    const place = this.#tool(`Place the ${this.#found.title.toLowerCase()}`, () => this.#place(), true);
    place.dataset.role = "place";
    this.#status.querySelector(".finding-tools")?.prepend(place);
  }

  async #place() {
    const question = { experiment: this.#experiment.id, frame: this.#frame, hint: JSON.stringify(this.#hintEditor?.mark) };
    const sighting = await this.#ask(() => api.mark(this.#upload.id, question));
    if (sighting) this.#take(sighting);
  }

  /**
   * Show the picture in which a person shows where the target is, or the one with the target's mark.
   *
   * @param {boolean} isHinting
   */
  #hinting(isHinting) {
    this.#editor.element.hidden = isHinting;
    if (this.#hintEditor) this.#hintEditor.element.hidden = !isHinting;
  }

  #forget() {
    this.#hinting(false);
    this.#hintEditor?.set(null);
    this.#editor.set(null);
    this.#on.changed();
  }

  /**
   * @param {string} ending
   * @param {boolean} [primary]
   */
  #hintTool(ending, primary = false) {
    return this.#hint && this.#tool(`Draw a ${this.#hint.title.toLowerCase()}${ending}`, () => this.#askForHint(), primary);
  }

  /**
   * @param {string} text
   * @param {() => void} run
   * @param {boolean} [primary]
   */
  #tool(text, run, primary = false) {
    return h("button", { type: "button", class: primary ? "primary" : null, on: { click: run } }, text);
  }
}
