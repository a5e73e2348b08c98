/** A table of what is truly so in an upload: given by a file, checked by the server, and kept until it is removed. */

import { api, messageOf } from "../shared/api.js";
import { fill, h } from "../shared/dom.js";
import { count } from "../shared/format.js";

/** @import { ExperimentPublic, TruthPublic, UploadPublic } from "../shared/messages.js" */

const TITLE = "Truth (CSV, optional)";
const ACCEPTED = ".csv,.txt,.xml,.json,text/csv";
const INPUT = "target-truth";
const WORDS = "target-truth-words";

/**
 * @typedef {object} Standing
 * @property {boolean} isBusy Whether a file is on its way.
 * @property {boolean} isRefused Whether the last one was refused, so that there is no truth though somebody has given one.
 */

export class TruthField {
  #upload;
  #experiment;
  #changed;
  // Once the field of another experiment has taken its place, nobody sees any more what becomes of this one.
  #field = h("div", { class: "target-truth" });

  /**
   * @param {HTMLElement} root
   * @param {UploadPublic} upload
   * @param {ExperimentPublic} experiment
   * @param {(standing: Standing) => void} changed
   */
  constructor(root, upload, experiment, changed) {
    this.#upload = upload;
    this.#experiment = experiment;
    this.#changed = changed;
    fill(root, this.#field);
    this.#begin();
  }

  async #begin() {
    const picker = this.#ask();
    try {
      const kept = await api.truth(this.#upload.id, this.#experiment.id);
      if (kept && picker.isConnected && picker.files?.length === 0) this.#tell(kept);
    } catch {
      // Then it can be given again.
    }
  }

  #done(isRefused = false) {
    if (this.#field.isConnected) this.#changed({ isBusy: false, isRefused });
  }

  /**
   * Ask for a file.
   *
   * @param {string} [refused] What was wrong with the last one, a sentence or more.
   */
  #ask(refused) {
    const picker = h("input", { type: "file", id: INPUT, accept: ACCEPTED, "aria-describedby": WORDS, "aria-invalid": String(Boolean(refused)) });
    picker.addEventListener("change", () => {
      const files = [...(picker.files ?? [])];
      if (files.length > 0) this.#give(files);
    });
    const columns = `With the columns ${this.#experiment.truth_columns.join(", ")}; frames count from\u00a00`;
    const words = refused ? h("p", { class: "wrong", role: "alert", id: WORDS }, refused) : h("p", { class: "hint", id: WORDS }, columns);
    fill(this.#field, h("label", { for: INPUT }, TITLE), picker, words);
    this.#done(refused !== undefined);
    // It was chosen at the end of a form that scrolls: what is said of it is to be seen, whole.
    if (refused !== undefined) this.#field.scrollIntoView({ block: "nearest" });
    return picker;
  }

  /**
   * Say what is known.
   *
   * @param {TruthPublic} truth
   */
  #tell(truth) {
    fill(
      this.#field,
      h("p", { class: "truth-title" }, TITLE),
      h(
        "p",
        { class: "truth-kept" },
        `Truth of ${count(truth.frames, "frame")}, ${truth.first} to ${truth.last}`,
        h("button", { type: "button", "aria-label": "Remove the truth", on: { click: () => this.#remove() } }, "Remove"),
      ),
      truth.warnings.map((warning) => h("p", { class: "note" }, warning)),
    );
    this.#done();
  }

  /** @param {File[]} files */
  async #give(files) {
    this.#changed({ isBusy: true, isRefused: false });
    try {
      this.#tell(await api.giveTruth(this.#upload.id, this.#experiment.id, files));
    } catch (error) {
      this.#ask(`${files.map(({ name }) => name).join(", ")} was not accepted. ${messageOf(error)}`);
    }
  }

  async #remove() {
    this.#changed({ isBusy: true, isRefused: false });
    try {
      await api.removeTruth(this.#upload.id, this.#experiment.id);
      this.#ask();
    } catch (error) {
      this.#ask(messageOf(error));
    }
  }
}
