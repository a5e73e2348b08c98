/** After an upload: which frame to begin with, what to follow, and how. */

import { api, messageOf } from "../shared/api.js";
import { fill, h, setText } from "../shared/dom.js";
import { count } from "../shared/format.js";
import { throttle } from "../shared/timing.js";
import { FoundTarget } from "./found_target.js";
import { MarkedTarget } from "./marked_target.js";
import { Suitability } from "./suitability.js";
import { TruthField } from "./truth.js";

/**
 * @typedef {import("../shared/messages.js").ExperimentPublic} ExperimentPublic
 * @typedef {import("../shared/messages.js").UploadPublic} UploadPublic
 */

const PICTURE_EVERY_MS = 80;

/** @type {Record<string, string>} What recordings have frames of that are no pictures, by kind. */
const WITHOUT_PICTURES = { tracks: " of tracks", beliefs: " of recorded beliefs" };

export class TargetForm {
  #upload;
  #able;
  #go = h("button", { type: "submit", class: "primary", disabled: true }, "Track it");
  #wrong = h("p", { class: "wrong", role: "alert", hidden: true });
  #experiment;
  #tracker = h("select", { id: "target-tracker" });
  #about = h("p", { class: "hint" });
  #at = h("output", {}, "0");
  #start;
  #stage = h("div", { class: "target-stage" });
  #suits = h("section", { class: "suits", "aria-label": "Can it be tracked?" });
  /** @type {Suitability|null} */
  #suitability = null;
  #truth = h("div");
  /** @type {FoundTarget|MarkedTarget|null} */
  #target = null;
  /** Whether something is on its way to the server that the session needs. */
  #isBusy = false;
  /** Whether a truth was given that is not used. */
  #isTruthRefused = false;
  /** Whether a person has said anything, so that nothing is chosen for them any more. */
  #isTouched = false;
  #proposal = h("p", { class: "note", role: "status", hidden: true });
  /** Whether the slider of frames was let go, so that the target is looked for where it stands. */
  #isSettled = false;

  /**
   * @param {HTMLElement} root
   * @param {UploadPublic} upload
   * @param {ExperimentPublic[]} experiments
   * @param {() => void} cancel
   */
  constructor(root, upload, experiments, cancel) {
    this.#upload = upload;
    this.#able = experiments.filter(({ footage }) => footage.includes(upload.kind));
    this.#experiment = h("select", { id: "target-experiment" }, this.#able.map((each) => h("option", { value: each.id }, each.clip_title)));
    this.#start = h("input", { type: "range", min: 0, max: Math.max(0, upload.frames - 1), value: 0, step: 1, id: "target-start" });
    fill(root, this.#form(cancel));
    this.#listen();
    if (this.#able.length === 0) {
      fill(this.#stage, h("p", { class: "wrong", role: "alert" }, "There is no experiment for a recording of this kind."));
      return;
    }
    this.#choose(this.#able.find(({ finds }) => finds === null) ?? this.#able[0]);
    this.#target?.focus();
    this.#propose();
  }

  /** Look for nothing any more, and wait for no answer. */
  leave() {
    this.#isTouched = true;
    this.#target?.leave();
    this.#suitability?.leave();
  }

  /** @param {ExperimentPublic} experiment */
  #choose(experiment) {
    this.#experiment.value = experiment.id;
    this.#listTrackers();
    this.#begin();
  }

  /** Look for what experiments find by themselves, while the form can be used already, and choose one that finds it. */
  async #propose() {
    for (const experiment of this.#able.filter(({ id, finds }) => finds !== null && id !== this.#chosen.id)) {
      const question = { experiment: experiment.id, frame: 0, last: 0 };
      const sighting = await api.mark(this.#upload.id, question).catch(() => null);
      if (this.#isTouched || this.#target?.footage || !this.#experiment.isConnected) return;
      if (!sighting?.mark) continue;
      this.#choose(experiment);
      setText(this.#proposal, `There is a ${experiment.target} in the picture. To follow something else, choose what else it is followed as.`);
      this.#proposal.hidden = false;
      return;
    }
  }

  /** Whether everything has been tracked already, by whoever has made the file. */
  get #isDone() {
    return this.#upload.kind === "beliefs";
  }

  get #chosen() {
    return this.#able.find(({ id }) => id === this.#experiment.value) ?? this.#able[0];
  }

  #listen() {
    const show = throttle(() => this.#showFrame(), PICTURE_EVERY_MS);
    this.#start.addEventListener("input", () => {
      this.#isTouched = true;
      show();
    });
    this.#start.addEventListener("change", () => {
      this.#isSettled = true;
      show();
    });
    this.#experiment.addEventListener("change", () => {
      this.#isTouched = true;
      this.#proposal.hidden = true;
      this.#listTrackers();
      this.#begin();
    });
    this.#tracker.addEventListener("change", () => this.#describe());
  }

  /** @param {() => void} cancel */
  #form(cancel) {
    const { name, kind, frames, width, height, frame_rate_hz: rate, warnings } = this.#upload;
    const content = WITHOUT_PICTURES[kind] ?? ` of ${width} × ${height} px at ${Number(rate.toPrecision(4))} Hz`;
    return h(
      "form",
      { class: "target", on: { submit: (/** @type {Event} */ event) => this.#submit(event) } },
      h(
        "header",
        {},
        h("h2", {}, this.#isDone ? "What another tracker has said" : "What should be tracked?"),
        h("p", { class: "hint" }, `${name}, ${count(frames, "frame")}${content}`),
        warnings.map((warning) => h("p", { class: "note" }, warning)),
      ),
      this.#stage,
      h(
        "div",
        { class: "target-choices" },
        this.#suits,
        this.#able.length > 1 && [h("label", { for: "target-experiment" }, "Follow it as"), this.#experiment, this.#proposal],
        h("label", { for: "target-start" }, "Start at picture ", this.#at),
        this.#start,
        h("label", { for: "target-tracker" }, "Tracker"),
        this.#tracker,
        this.#about,
        this.#truth,
        this.#wrong,
        h("footer", {}, h("button", { type: "button", on: { click: cancel } }, "Cancel"), this.#go),
      ),
    );
  }

  /** Ask for the target of the chosen experiment. */
  #begin() {
    const experiment = this.#chosen;
    const on = {
      changed: () => this.#check(),
      moved: (/** @type {number} */ frame) => {
        this.#start.value = String(frame);
        this.#tellFrame();
      },
    };
    this.#target?.leave();
    this.#suitability?.leave();
    this.#suitability = new Suitability(this.#suits, this.#upload, experiment, (mark) => this.#target?.adopt(mark));
    const target = experiment.finds
      ? new FoundTarget(this.#stage, this.#upload, experiment, on)
      : new MarkedTarget(this.#stage, this.#upload, experiment, on);
    this.#target = target;
    this.#tellFrame();
    target.show(Number(this.#start.value));
    target.find();
    this.#check();
    fill(this.#truth);
    this.#isBusy = this.#isTruthRefused = false;
    if (experiment.truth_columns.length > 0) {
      new TruthField(this.#truth, this.#upload, experiment, ({ isBusy, isRefused }) => {
        this.#isBusy = isBusy;
        this.#isTruthRefused = isRefused;
        this.#check();
      });
    }
    return target;
  }

  #showFrame() {
    this.#tellFrame();
    this.#target?.show(Number(this.#start.value));
    if (this.#isSettled) this.#target?.find({ alone: true });
    this.#isSettled = false;
  }

  #tellFrame() {
    setText(this.#at, `${this.#start.value} of ${this.#upload.frames}, frame 0 of the session`);
  }

  #listTrackers() {
    const { trackers, default_tracker: preferred } = this.#chosen;
    fill(this.#tracker, trackers.map(({ id, title }) => h("option", { value: id, selected: id === preferred }, title)));
    this.#describe();
  }

  #describe() {
    setText(this.#about, this.#chosen.trackers.find(({ id }) => id === this.#tracker.value)?.description ?? "");
  }

  /** Say whether there is all that a session needs. */
  #check() {
    this.#go.disabled = this.#isBusy || !this.#target?.footage;
    setText(this.#go, `${this.#isDone ? "Open it" : "Track it"}${this.#isTruthRefused ? " without truth" : ""}`);
    this.#suitability?.ask(this.#target?.footage);
    this.#wrong.hidden = true;
  }

  /** @param {Event} event */
  async #submit(event) {
    event.preventDefault();
    this.#go.disabled = true;
    try {
      const recipe = { experiment: this.#experiment.value, tracker: this.#tracker.value, footage: this.#target?.footage };
      const session = await api.start({ recipe, upload: this.#upload.id });
      location.assign(session.page);
    } catch (error) {
      setText(this.#wrong, messageOf(error));
      this.#wrong.hidden = false;
      this.#go.disabled = false;
    }
  }
}
