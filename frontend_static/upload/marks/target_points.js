/**
 * The features of a target that is found by itself: looked for with progress, shown to be corrected, and, where nothing
 * was found, placed in a box that a person draws.
 */

import { api } from "../../shared/api.js";
import { BoxEditor } from "./box_editor.js";
import { fill, h, setText } from "../../shared/dom.js";
import { PointsEditor } from "./points_editor.js";

const SLOW_MS = 200;

export class PointsTarget {
  #upload;
  #experiment;
  #on;
  #frame = 0;
  /** Counts what was asked for: an answer to anything but the newest question is dropped. */
  #asked = 0;
  #points;
  #box;
  #pointsRoot = h("div", { class: "target-stage" });
  #boxRoot = h("div", { class: "target-stage", hidden: true });
  #status = h("div", { class: "finding" });

  /**
   * @param {HTMLElement} root
   * @param {object} upload
   * @param {object} experiment
   * @param {{changed: () => void, moved: (frame: number) => void}} on `moved`: the target was found in a later frame.
   */
  constructor(root, upload, experiment, on) {
    [this.#upload, this.#experiment, this.#on] = [upload, experiment, on];
    this.#points = new PointsEditor(this.#pointsRoot, experiment.target, markOf(experiment, experiment.finds), () => on.changed());
    this.#box = new BoxEditor(this.#boxRoot, (box) => box && this.#boxRoot.hidden === false && this.#offerPlacing());
    fill(root, this.#pointsRoot, this.#boxRoot, this.#status);
  }

  /** What a session is told of the target, or null while there is nothing to tell. */
  get footage() {
    const { points } = this.#points;
    return points && { mark: { kind: this.#experiment.finds, points }, start: this.#frame };
  }

  /** Show a frame; what was found in another one counts no more. */
  show(frame) {
    this.#asked += 1;
    this.#frame = frame;
    const address = api.pictureAddress(this.#upload.id, frame);
    for (const editor of [this.#points, this.#box]) editor.show(address, this.#upload.width, this.#upload.height);
    this.#forget();
    fill(this.#status);
  }

  /** Look for the target from the frame that is shown on, or in that alone, since it is `nowhere` in the others. */
  async find({ alone = false, nowhere = false } = {}) {
    const frame = this.#frame;
    this.#forget();
    const question = { experiment: this.#experiment.id, frame, ...(alone && { last: frame }) };
    const found = await this.#ask(async (told) => {
      for (let looked = 0; ; ) {
        const answer = await api.mark(this.#upload.id, { ...question, looked });
        if (answer.mark || answer.looked >= answer.of) return answer;
        looked = answer.looked;
        if (!told(looked, answer.of)) return null;
      }
    });
    if (!found) return;
    if (found.mark) this.#take(found);
    // Of the frame that was asked for it is said why there is no target, or what may be one is shown.
    else if (!alone) await this.find({ alone: true, nowhere: true });
    else this.#refuse([...found.remarks, nowhere && "None was found in later frames either."], nowhere);
  }

  focus() {
    this.#points.focus();
  }

  leave() {
    this.#asked += 1;
  }

  /** Await an answer with progress after a while; null if it is not wanted any more or was refused. */
  async #ask(question) {
    const asked = (this.#asked += 1);
    const wanted = () => asked === this.#asked;
    const looking = `Looking for a ${this.#experiment.target}`;
    const meter = h("progress", { max: 1, "aria-label": looking });
    const words = h("p", { class: "hint", role: "status" }, looking);
    const stop = () => (this.leave(), this.#refuse(["The search was stopped."]));
    fill(this.#status);
    const slow = setTimeout(
      () => wanted() && fill(this.#status, words, meter, h("button", { type: "button", on: { click: stop } }, "Stop")),
      SLOW_MS,
    );
    try {
      const answer = await question((looked, of) => {
        meter.value = looked / of;
        setText(words, `${looking}, ${looked} of ${of} frames`);
        return wanted();
      });
      return wanted() ? answer : null;
    } catch (error) {
      if (wanted()) this.#refuse([error.message]);
      return null;
    } finally {
      clearTimeout(slow);
    }
  }

  #take(found) {
    if (found.frame !== this.#frame) {
      const wanted = this.#frame;
      this.show(found.frame);
      this.#on.moved(found.frame);
      found.remarks = [`The first suitable ${this.#experiment.target} from frame ${wanted} on is in frame ${found.frame}.`, ...found.remarks];
    }
    this.#stage("points");
    this.#points.set(found.mark.points, found.placed.map((handle) => handle.replace(/^points\./, "")));
    const hollow = found.placed.length > 0 && "Hollow points were placed by the model; look at them first. ";
    fill(
      this.#status,
      found.remarks.map((remark) => h("p", { class: "note" }, remark)),
      h("p", { class: "hint" }, "Drag a point to where it belongs, or Tab to it and use the arrows, with shift for 10 px. ", hollow, this.#experiment.advice),
      h("div", { class: "finding-tools" }, this.#tool("Find again", () => this.find({ alone: true })), this.#tool("Draw a box instead…", () => this.#drawBox())),
    );
    this.#on.changed();
  }

  #refuse(remarks, nowhere = false) {
    const later = !nowhere && this.#frame < this.#upload.frames - 1;
    fill(
      this.#status,
      h("p", { class: "wrong", role: "alert" }, remarks.filter(Boolean).join(" ")),
      h("p", { class: "hint" }, `Mark the ${this.#experiment.target} by a box, or choose another frame.`),
      h(
        "div",
        { class: "finding-tools" },
        this.#tool("Draw a box…", () => this.#drawBox(), true),
        later && this.#tool("Look in later frames", () => this.find()),
        this.#tool("Try again", () => this.find({ alone: true })),
      ),
    );
    this.#on.changed();
  }

  #drawBox() {
    this.#asked += 1;
    this.#forget();
    this.#stage("box");
    fill(this.#status, h("p", { class: "hint" }, markOf(this.#experiment, this.#experiment.hints[0]).instruction), h("div", { class: "finding-tools" }, this.#tool("Find again", () => this.find({ alone: true }))));
    this.#box.focus();
  }

  #offerPlacing() {
    if (this.#status.querySelector("[data-role=place]")) return;
    const place = this.#tool("Place the points", () => this.#place(), true);
    place.dataset.role = "place";
    this.#status.querySelector(".finding-tools")?.prepend(place);
  }

  async #place() {
    const question = { experiment: this.#experiment.id, frame: this.#frame, hint: JSON.stringify(this.#box.mark) };
    const found = await this.#ask(() => api.mark(this.#upload.id, question));
    if (found) this.#take(found);
  }

  /** Show the picture with points, or the one in which a box is drawn. */
  #stage(name) {
    this.#pointsRoot.hidden = name !== "points";
    this.#boxRoot.hidden = name !== "box";
  }

  #forget() {
    this.#stage("points");
    this.#box.box = null;
    this.#points.set({}, []);
    this.#on.changed();
  }

  #tool(text, run, primary = false) {
    return h("button", { type: "button", class: primary ? "primary" : null, on: { click: run } }, text);
  }
}

/** What an experiment says of a kind of mark that it takes. */
function markOf(experiment, kind) {
  return experiment.marks.find((mark) => mark.kind === kind);
}
