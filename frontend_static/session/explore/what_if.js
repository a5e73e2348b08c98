/**
 * What would have saved the run: a list that fills while one looks, best first. Each line opens as a branch, or is varied in
 * a sweep.
 */

import { api } from "../../shared/api.js";
import { fill, h, setText } from "../../shared/dom.js";
import { iconButton } from "../../shared/icons.js";
import { isParticipant } from "../../shared/participant.js";
import { newSweep } from "../../shared/share_link.js";
import { attempt } from "../../shared/toast.js";
import { isGone } from "../history.js";
import { Exploration } from "./exploration.js";
import { Line } from "./line.js";

/** @import { ExplorationJob, Report, ToldFinding } from "../../shared/messages.js" */

const HINT = "Change one thing before the loss, and see with many seeds whether the run then holds";
const LONGER_S = 120;
const TRIALS = 40;

export class WhatIf {
  #view;
  #exploration;
  /** @type {Map<string, Line>} By what is changed. */
  #lines = new Map();
  /** @type {Report|null} */
  #found = null;
  /** @type {Record<string, import("../../shared/format.js").Value>} Those of the run that was lost. */
  #parameters = {};
  opener = h("button", { type: "button", class: "chip", hidden: true, "aria-expanded": "false", title: HINT }, "What if…");
  #status = h("p", { class: "what-if-status", role: "status" });
  #list = h("ol", { class: "what-if-lines", "aria-label": "Changes, best first" });
  #correction = h("p", { class: "hint", hidden: true });
  /** @type {number|null} The frame that was asked about. */
  #frame = null;
  #more = h("button", { type: "button", hidden: true }, "Go on");
  #sweep = h("a", { class: "button", hidden: true, title: "The best change beside none, on the scenes and seeds of a sweep" }, "Check on the whole sweep");
  card = h("section", { class: "what-if", "aria-label": "What would have saved it", hidden: true });

  /** @param {import("../mount.js").Mounted} view */
  constructor(view) {
    this.#view = view;
    const { store, signal } = view;
    const on = { found: (/** @type {ExplorationJob} */ told) => this.#take(told), failed: (/** @type {string} */ message) => this.#fail(message) };
    this.#exploration = new Exploration(() => store.known.id, on, signal);
    this.opener.addEventListener("click", () => (this.card.hidden ? this.#open(20) : this.#close()));
    this.#more.addEventListener("click", () => this.#goOn());
    this.card.addEventListener("keydown", (event) => {
      if (event.key !== "Escape") return;
      event.stopPropagation();
      this.#close();
    });
    fill(
      this.card,
      h("header", {}, h("h2", {}, "What if…"), iconButton("close", "Close", () => this.#close())),
      this.#status,
      this.#list,
      this.#correction,
      h("p", { class: "hint what-if-caveat" }, "A cure of this run is not a cure in general."),
      h("footer", {}, this.#more, this.#sweep),
    );
  }

  /** Offer it where there is a loss, to who can open what is found. */
  update() {
    const { store } = this.#view;
    this.opener.hidden = isParticipant || store.isReadOnly || (!store.knowsLoss && this.card.hidden);
  }

  /** @param {number} seconds */
  #open(seconds) {
    this.card.hidden = false;
    // Below other cards it would open out of sight.
    this.card.scrollIntoView({ block: "start" });
    this.opener.setAttribute("aria-expanded", "true");
    this.#lines.clear();
    this.#found = null;
    this.#parameters = this.#view.store.known.parameters;
    fill(this.#list);
    this.#more.hidden = this.#sweep.hidden = this.#correction.hidden = true;
    setText(this.#status, "Going back to before the loss…");
    this.#frame = this.#loss();
    this.#exploration.begin({ kind: "what-if", frame: this.#frame, seconds });
  }

  /** Try what time was too short for, with what has been found. */
  #goOn() {
    this.#more.hidden = true;
    this.#exploration.goOn({ kind: "what-if", frame: this.#frame, seconds: LONGER_S });
  }

  #close() {
    this.#exploration.stop();
    this.card.hidden = true;
    this.opener.setAttribute("aria-expanded", "false");
    this.update();
    // A branch that holds has nothing to ask any more.
    const next = this.opener.hidden ? this.opener.parentElement?.querySelector("button") : this.opener;
    next?.focus();
  }

  /** The frame that is shown where it is lost, so that this loss is meant; else the first that lasts. */
  #loss() {
    const { history, known } = this.#view.store;
    return isGone(history.at(known.position)) ? known.position : null;
  }

  /** @param {ExplorationJob} told */
  #take({ state, result, error }) {
    if (result !== null && "findings" in result) this.#show(result, state === "done");
    if (state === "failed") this.#fail(error ?? "This could not be found out.");
  }

  /** @param {string} message */
  #fail(message) {
    setText(this.#status, message);
    this.#more.hidden = true;
  }

  /**
   * @param {Report} found
   * @param {boolean} isOver
   */
  #show(found, isOver) {
    const isFirst = this.#found === null;
    this.#found = found;
    const left = isOver ? "" : " Trying…";
    setText(this.#status, `${found.loss_sentence} ${found.sentence} ${found.progress}${left}`);
    setText(this.#correction, found.correction);
    this.#correction.hidden = false;
    const lines = found.findings.map((finding) => this.#line(finding));
    // A line that has the focus stays where it is.
    if (!this.#list.contains(document.activeElement)) fill(this.#list, lines.map(({ element }) => element));
    this.#more.hidden = !isOver || found.is_complete;
    const best = found.findings.find(({ verdict }) => verdict === "better");
    this.#sweep.hidden = best === undefined;
    if (best) this.#sweep.href = this.#sweepOf(best);
    // Empty it was not tall enough to be scrolled to.
    if (isFirst) this.card.scrollIntoView({ block: "nearest" });
  }

  /** @param {ToldFinding} finding */
  #line(finding) {
    const key = JSON.stringify(finding.values);
    const line = this.#lines.get(key) ?? new Line(() => this.#branch(key));
    this.#lines.set(key, line);
    line.show(finding, finding.verdict === "baseline" ? "" : this.#sweepOf(finding));
    return line;
  }

  /**
   * Open a line beside the lost run, and let it go on to where it was judged.
   *
   * @param {string} key
   */
  async #branch(key) {
    const { store, commands } = this.#view;
    const found = this.#found;
    const finding = found?.findings.find(({ values }) => JSON.stringify(values) === key);
    if (!found || !finding) return;
    const { values, seed, title } = finding;
    const made = await commands.branch({ frame: found.begin, values, seed, title });
    if (made) await attempt(() => api.command(store.known.id, { kind: "seek", frame: found.end }));
  }

  /**
   * A sweep over a change and none, with the settings that the run began with.
   *
   * @param {ToldFinding} finding
   */
  #sweepOf({ values, parameter }) {
    const { recipe, tracker, upload } = this.#view.store.known;
    const [first] = recipe.timeline ?? [];
    const begun = first?.frame === 0 ? first.values : {};
    const trackers = [...new Set([recipe.tracker ?? tracker, ...("tracker" in values ? [String(values.tracker)] : [])])];
    const axes = parameter ? [{ name: parameter, values: [this.#parameters[parameter], values[parameter]] }] : [];
    const rest = Object.fromEntries(Object.entries(begun).filter(([name]) => name !== parameter));
    const on = upload ? { upload, footage: recipe.footage } : {};
    return newSweep({ experiment: recipe.experiment, axes, trackers, trials: TRIALS, parameters: rest, ...on });
  }
}
