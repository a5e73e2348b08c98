/** Before tracking: whether a target can be followed, where in the picture the likelihood is high, and what would help. */

import { api, messageOf } from "../shared/api.js";
import { fill, h } from "../shared/dom.js";
import { VIRIDIS } from "../shared/palette.js";

/** @import { Child } from "../shared/elements.js" */
/** @import { ExperimentPublic, SuitabilityPublic, UploadPublic } from "../shared/messages.js" */
/** @import { Mark } from "../shared/marks/mark_json.js" */

/** @typedef {{mark?: Mark, start: number}} Footage What is said of the target, and from which frame on. */

/** So long a mark must stand still before it is looked at: while a box is dragged, it changes with every movement. */
const STILL_MS = 250;
const SLOW_MS = 400;

export class Suitability {
  /** @type {UploadPublic} */
  #upload;
  /** @type {ExperimentPublic} */
  #experiment;
  /** @type {(mark: Mark) => void} */
  #take;
  /** @type {HTMLElement} */
  #root;
  /** What was asked last, as text; an answer to anything else is dropped. */
  #asked = "";
  #abort = new AbortController();
  #timer = 0;
  #picture = h("img", { class: "suits-picture", alt: "", hidden: true });
  #key = h("p", { class: "suits-key hint", hidden: true });
  #words = h("div", { class: "suits-words", role: "status" });

  /**
   * @param {HTMLElement} root
   * @param {UploadPublic} upload
   * @param {ExperimentPublic} experiment
   * @param {(mark: Mark) => void} take Called when a person takes a mark that suits better.
   */
  constructor(root, upload, experiment, take) {
    [this.#root, this.#upload, this.#experiment, this.#take] = [root, upload, experiment, take];
    root.hidden = !experiment.suits;
    const ramp = h("span", { class: "suits-ramp" });
    ramp.style.background = `linear-gradient(90deg, ${VIRIDIS.map((colour) => `rgb(${colour.join(" ")})`).join(", ")})`;
    fill(this.#key, "Likelihood ", h("span", {}, "low"), ramp, h("span", {}, "high"));
    fill(root, this.#picture, this.#key, this.#words);
    this.#invite();
  }

  /**
   * Look at a target once it stands still; forget the last one if there is none now.
   *
   * @param {Footage|null|undefined} footage
   */
  ask(footage) {
    if (!this.#experiment.suits) return;
    const { mark, start } = footage ?? {};
    const asked = mark ? JSON.stringify([mark, start]) : "";
    if (asked === this.#asked) return;
    this.leave();
    this.#asked = asked;
    if (!mark) {
      this.#invite();
      return;
    }
    this.#timer = setTimeout(() => this.#look(asked, mark, Number(start)), STILL_MS);
  }

  /** Wait for no answer any more. */
  leave() {
    clearTimeout(this.#timer);
    this.#abort.abort();
    this.#abort = new AbortController();
    this.#asked = "";
  }

  /**
   * @param {string} asked
   * @param {Mark} mark
   * @param {number} frame
   */
  async #look(asked, mark, frame) {
    const wanted = () => asked === this.#asked;
    const slow = setTimeout(() => wanted() && this.#wait(), SLOW_MS);
    const question = { experiment: this.#experiment.id, frame, mark: JSON.stringify(mark) };
    try {
      const found = await api.suitability(this.#upload.id, question, this.#abort.signal);
      if (wanted()) this.#show(found);
    } catch (error) {
      if (wanted()) this.#say("", h("p", { class: "wrong", role: "alert" }, messageOf(error)));
    } finally {
      clearTimeout(slow);
    }
  }

  #invite() {
    this.#say("", h("p", { class: "hint" }, "Mark the target to see whether it can be tracked."));
  }

  #wait() {
    const stop = () => {
      this.leave();
      this.#invite();
    };
    const words = "Checking whether this target can be tracked";
    // The last picture stays until there is another one, so that nothing jumps.
    this.#root.classList.add("stale");
    this.#words.dataset.grade = "";
    fill(this.#words, h("p", { class: "hint" }, words), h("progress", { "aria-label": words }), h("button", { type: "button", on: { click: stop } }, "Stop"));
  }

  /** @param {SuitabilityPublic} found */
  #show({ grade, remark, advice, better, picture }) {
    this.#say(
      grade,
      h("p", { class: "suits-remark" }, remark),
      advice.map((said) => h("p", { class: "hint" }, said)),
      better && h("button", { type: "button", data: { role: "better" }, on: { click: () => this.#take(better) } }, "Use the proposed mark"),
    );
    if (!picture) return;
    this.#picture.src = picture;
    this.#picture.alt = `Likelihood over the picture. ${remark}`;
    [this.#picture.width, this.#picture.height] = [this.#upload.width, this.#upload.height];
    this.#picture.hidden = this.#key.hidden = false;
  }

  /**
   * @param {string} grade
   * @param {...Child} content
   */
  #say(grade, ...content) {
    this.#root.classList.remove("stale");
    this.#picture.hidden = this.#key.hidden = true;
    this.#words.dataset.grade = grade;
    fill(this.#words, ...content);
  }
}
