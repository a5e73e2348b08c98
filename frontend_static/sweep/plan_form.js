/** The form of a sweep's plan: what is varied, by whom, how often; with the size and the time before anything starts. */

import { messageOf } from "../shared/api.js";
import { h } from "../shared/dom.js";
import { toast } from "../shared/toast.js";
import { AxisRow } from "./axis.js";
import { field, numberOf, wrong } from "./fields.js";
import { FixedRow } from "./fixed_row.js";
import { SizeCard } from "./size.js";

/** @import { ExperimentDetail, ExperimentPublic, SweepAxis, SweepCreate, UploadPublic } from "../shared/messages.js" */
/** @import { Draft } from "./api.js" */

const NUMBERS = ["integer", "number"];

export class PlanForm {
  #experiment;
  /** @type {Partial<SweepCreate>} */
  #recording;
  /** @type {AxisRow[]} */
  #axes = [];
  #axisList = h("div", { class: "axes" });
  /** @type {FixedRow[]} */
  #fixed = [];
  #fixedList = h("div", {});
  #methods;
  #amounts;
  #loss;
  #title;
  #form;
  #size;

  /**
   * @param {ExperimentPublic[]} experiments
   * @param {ExperimentDetail} experiment The one of these that is swept.
   * @param {SweepCreate} plan What the form is filled in with.
   * @param {UploadPublic|null} upload The recording on which all runs are, if there is one.
   * @param {(id: string) => Promise<void>} choose Have the form of another experiment.
   */
  constructor(experiments, experiment, plan, upload, choose) {
    this.#experiment = experiment;
    this.#recording = upload ? { upload: upload.id, footage: plan.footage } : {};
    const changed = () => this.#changed();
    this.#methods = experiment.trackers.map(({ id, title, description }) => {
      const box = h("input", { type: "checkbox", value: id, checked: plan.trackers?.includes(id), on: { change: changed } });
      return { box, label: h("label", { title: description }, box, title) };
    });
    this.#amounts = {
      trials: amount("Trials in each cell", plan.trials, 1, changed),
      frames: amount("Frames of a run", plan.frames ?? (upload ? upload.frames - (plan.footage?.start ?? 0) : experiment.frames), 1, changed),
      seed: amount("Seed", plan.seed ?? 0, 0, changed),
    };
    this.#loss = h("input", { type: "checkbox", checked: plan.loss_probability, on: { change: changed } });
    this.#title = h("input", { type: "text", value: plan.title ?? "", maxlength: 200, placeholder: "Generated from the plan", "aria-label": "Title" });
    this.#form = this.#layout(this.#chooser(upload ? experiments.map((each) => ({ ...each, title: each.clip_title })) : experiments, choose), upload);
    this.#size = new SizeCard(this.#form, () => this.#read(), (estimate) => this.#axes.forEach((axis) => axis.preview(estimate)));
    this.#form.addEventListener("submit", (event) => {
      event.preventDefault();
      this.#size.start();
    });
    for (const axis of plan.axes) this.#addAxis(axis);
    const isKnown = (/** @type {string} */ name) => experiment.declarations.some((each) => each.name === name);
    const given = Object.entries(plan.parameters ?? {});
    for (const [name, value] of given) if (isKnown(name)) this.#addFixed(name, value);
    // What a file declares is known only where the file is executed.
    const own = given.map(([name]) => name).filter((name) => !isKnown(name));
    if (own.length > 0) this.#fixedList.append(h("p", { class: "hint" }, `Parameters of a file keep the file's defaults: ${own.join(", ")}.`));
    this.#changed();
  }

  /** What is put into the page. */
  get elements() {
    return [this.#form, this.#size.element];
  }

  /** Ask nothing more: another form takes its place. */
  leave() {
    this.#size.leave();
  }

  #changed() {
    this.#size.changed();
  }

  /**
   * What is planned now.
   *
   * @returns {Draft}
   */
  #read() {
    const title = this.#title.value.trim();
    return {
      ...(title !== "" && { title }),
      experiment: this.#experiment.id,
      ...this.#recording,
      axes: this.#axes.map((axis) => axis.read()),
      trackers: this.#methods.filter(({ box }) => box.checked).map(({ box }) => box.value),
      trials: this.#amounts.trials.read(),
      frames: this.#amounts.frames.read(),
      seed: this.#amounts.seed.read(),
      loss_probability: this.#loss.checked,
      parameters: Object.fromEntries(this.#fixed.map((row) => [row.name, row.read()])),
    };
  }

  /** @param {SweepAxis} given */
  #addAxis(given) {
    const remove = () => {
      this.#axes = this.#axes.filter((other) => other !== axis);
      axis.element.remove();
      this.#number();
      this.#changed();
    };
    const axis = new AxisRow(this.#experiment.declarations, given, { changed: () => this.#changed(), remove });
    this.#axes.push(axis);
    this.#axisList.append(axis.element);
    this.#number();
  }

  /** Tell the axes their places, by which the server names what is wrong with one. */
  #number() {
    // On a recording nothing need be varied: other seeds are something to see.
    const isRemovable = this.#axes.length > 1 || this.#recording.upload !== undefined;
    this.#axes.forEach((axis, index) => axis.number(index, isRemovable));
  }

  /**
   * @param {string} name
   * @param {unknown} [value] The default if not given.
   */
  #addFixed(name, value) {
    const remove = () => {
      this.#fixed = this.#fixed.filter((other) => other !== row);
      row.element.remove();
      this.#changed();
    };
    const row = new FixedRow(this.#experiment.declarations, name, value, { changed: () => this.#changed(), remove });
    this.#fixed.push(row);
    this.#fixedList.append(row.element);
  }

  /**
   * The first parameter of some kinds that is neither varied nor fixed.
   *
   * @param {string[]} kinds
   */
  #unused(kinds) {
    const used = new Set([...this.#axes, ...this.#fixed].map(({ name }) => name));
    const { declarations } = this.#experiment;
    return declarations.find(({ kind, name }) => kinds.includes(kind) && !used.has(name))?.name ?? declarations[0].name;
  }

  /**
   * @param {ExperimentPublic[]} experiments
   * @param {(id: string) => Promise<void>} choose
   */
  #chooser(experiments, choose) {
    const options = experiments.map(({ id, title }) => h("option", { value: id, selected: id === this.#experiment.id }, title));
    const chooser = h("select", { "aria-label": "Experiment", data: { field: "experiment" } }, options);
    chooser.addEventListener("change", async () => {
      // What is filled in from now on would be gone with this form; one may still choose otherwise.
      this.#hold(chooser, true);
      try {
        await choose(chooser.value);
      } catch (error) {
        chooser.value = this.#experiment.id;
        toast(messageOf(error), { kind: "error" });
      } finally {
        this.#hold(chooser, false);
      }
    });
    return chooser;
  }

  /**
   * @param {HTMLElement} chooser What stays in use.
   * @param {boolean} isHeld Whether all the rest takes no input.
   */
  #hold(chooser, isHeld) {
    for (const part of [...this.#form.children, this.#size.element]) if (part instanceof HTMLElement) part.inert = isHeld && !part.contains(chooser);
  }

  /**
   * @param {HTMLElement} chooser
   * @param {UploadPublic|null} upload
   */
  #layout(chooser, upload) {
    const { question, description } = this.#experiment;
    const about = upload ? `All runs are on ${upload.name}; without an axis the trials are other seeds.` : `${question} ${description}`;
    return h(
      "form",
      { class: "plan-form", novalidate: true },
      h("section", { class: "plan-part" }, h("h2", {}, "Experiment"), chooser, h("p", { class: "hint" }, about)),
      h(
        "section",
        { class: "plan-part", data: { field: "axes" } },
        h("h2", {}, "What is varied"),
        this.#axisList,
        wrong(),
        this.#adder("add-axis", "Add an axis", () => this.#addAxis({ name: this.#unused(NUMBERS) })),
        h("p", { class: "hint" }, "Axes multiply. A map shows two of them; further ones are pooled, and you can choose which."),
      ),
      h(
        "section",
        { class: "plan-part", data: { field: "trackers" } },
        h("h2", {}, "Trackers"),
        h("div", { class: "methods" }, this.#methods.map(({ label }) => label)),
        wrong(),
        h("p", { class: "hint" }, "All trackers meet the same scenes and seeds."),
      ),
      h(
        "section",
        { class: "plan-part" },
        h("h2", {}, "Runs"),
        h(
          "div",
          { class: "plan-fields" },
          Object.entries(this.#amounts).map(([name, one]) => field(name, one.title, one.input)),
          h("div", { class: "grow" }, field("title", "Title (optional)", this.#title)),
        ),
        this.#lossPart(),
      ),
      h(
        "section",
        { class: "plan-part", data: { field: "parameters" } },
        h("h2", {}, "Fixed parameters"),
        h("p", { class: "hint" }, "All other parameters keep the experiment's defaults."),
        this.#fixedList,
        wrong(),
        this.#adder("add-fixed", "Fix a parameter", () => this.#addFixed(this.#unused([...NUMBERS, "choice"]))),
      ),
    );
  }

  /** Whether how probable a loss is is measured, where any method can tell. */
  #lossPart() {
    const able = this.#methods.filter(({ box }) => this.#experiment.loss_trackers.includes(box.value));
    if (able.length === 0) return null;
    const who = able.length === this.#methods.length ? "" : ` Only some trackers can tell: ${able.map(({ label }) => label.textContent).join(", ")}.`;
    const hint = `As the trackers say themselves, without a look at the truth.${who} Fast trackers take longer for it, see the estimate.`;
    const label = h("label", { class: "check" }, this.#loss, "Measure how probable it is that the target is lost, too");
    return h("div", { data: { field: "loss_probability" } }, label, wrong(), h("p", { class: "hint" }, hint));
  }

  /**
   * A button that adds something.
   *
   * @param {string} role
   * @param {string} words
   * @param {() => void} add
   */
  #adder(role, words, add) {
    const press = () => {
      add();
      this.#changed();
    };
    return h("div", {}, h("button", { type: "button", data: { role }, on: { click: press } }, words));
  }
}

/**
 * @param {string} title
 * @param {number|null|undefined} value
 * @param {number} least
 * @param {() => void} changed
 */
function amount(title, value, least, changed) {
  const input = h("input", { type: "number", value, min: least, step: 1, on: { input: changed } });
  return { title, input, read: () => numberOf(input) };
}
