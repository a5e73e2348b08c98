/** How large the plan is and how long it will take, kept up to date while the form is filled in; and the start. */

import { ApiError, messageOf, statusOf } from "../shared/api.js";
import { fill, h } from "../shared/dom.js";
import { bytes, count, duration } from "../shared/format.js";
import { later } from "../shared/timing.js";
import { toast } from "../shared/toast.js";
import { sweeps } from "./api.js";
import { clearErrors, showError } from "./fields.js";

/** @import { EstimatePublic } from "../shared/messages.js" */
/** @import { Draft } from "./api.js" */

const COUNT_AFTER_MS = 150;
const MEASURE_AFTER_MS = 700;
const ASK_AGAIN_MS = 3000;

export class SizeCard {
  #form;
  #read;
  #sized;
  #runs = h("p", { class: "figure" }, "–");
  #words = h("div", { class: "size-words" });
  #time = h("p", { class: "figure", data: { role: "time" } }, "–");
  #jobs = h("p", { class: "hint", data: { role: "jobs" } });
  #problem = h("p", { class: "note", hidden: true });
  #button = h("button", { type: "button", class: "primary", on: { click: () => this.start() } }, "Start the sweep");
  /** Ends what waits to be asked; an answer to anything that was asked before counts no more. */
  #outdated = new AbortController();
  element = h(
    "aside",
    { class: "plan-size", "aria-label": "Size" },
    h("div", { role: "status" }, this.#runs, this.#words),
    h("div", {}, this.#time, this.#jobs),
    this.#problem,
    this.#button,
  );

  /**
   * @param {HTMLFormElement} form
   * @param {() => Draft} read What is asked for now.
   * @param {(estimate: EstimatePublic) => void} sized
   */
  constructor(form, read, sized) {
    this.#form = form;
    this.#read = read;
    this.#sized = sized;
  }

  /** The plan is another one now. */
  changed() {
    this.element.classList.add("stale");
    const { signal } = this.#renew();
    later(() => this.#look(false, signal), COUNT_AFTER_MS, signal);
    later(() => this.#look(true, signal), MEASURE_AFTER_MS, signal);
  }

  /** Ask nothing more. */
  leave() {
    this.#outdated.abort();
  }

  async start() {
    this.#button.disabled = true;
    this.#renew();
    try {
      const sweep = await sweeps.begin(this.#read());
      location.assign(sweep.page);
    } catch (error) {
      this.#refuse(error);
      this.#button.disabled = false;
      if (!(error instanceof ApiError) || error.field === undefined) toast(messageOf(error), { kind: "error" });
    }
  }

  #renew() {
    this.#outdated.abort();
    this.#outdated = new AbortController();
    return this.#outdated;
  }

  /**
   * @param {boolean} measure
   * @param {AbortSignal} signal Ends the interest in the answer.
   */
  async #look(measure, signal) {
    if (measure && !this.#button.disabled) {
      fill(this.#time, h("small", {}, "measuring the time"));
      fill(this.#jobs);
    }
    try {
      const found = await sweeps.estimate(this.#read(), measure);
      if (!signal.aborted) this.#show(found, signal);
    } catch (error) {
      if (!signal.aborted) this.#refuse(error);
    }
  }

  /**
   * @param {EstimatePublic} found
   * @param {AbortSignal} signal
   */
  #show(found, signal) {
    clearErrors(this.#form);
    this.element.classList.remove("stale");
    this.#sized(found);
    const methods = found.runs / found.conditions;
    fill(this.#runs, found.runs.toLocaleString("en-GB"), " ", h("small", {}, found.runs === 1 ? "run" : "runs"));
    fill(
      this.#words,
      h("p", {}, `${count(found.conditions, "condition")} × ${count(methods, "run")}`),
      h("p", { class: "hint" }, `${count(found.cells, "cell")} a map, at most ${bytes(found.bytes)}`),
    );
    if (found.seconds !== null) {
      fill(this.#time, duration(found.seconds), " ", h("small", {}, "to compute"));
      fill(this.#jobs, `Measured on a few runs, for ${found.jobs === 1 ? "1 process" : `${found.jobs} processes`}; add some seconds for the start.`);
    }
    // Why the sweep cannot be started now, if it cannot.
    this.#problem.hidden = found.problem === null;
    this.#problem.textContent = found.problem ?? "";
    this.#button.disabled = found.problem !== null;
    // A place may become free, or room on the disk.
    if (found.problem !== null) later(() => this.#look(false, signal), ASK_AGAIN_MS, signal);
  }

  /** @param {unknown} error */
  #refuse(error) {
    this.element.classList.add("stale");
    fill(this.#time, "–");
    fill(this.#jobs);
    this.#button.disabled = statusOf(error) === 422;
    const isPlaced = error instanceof ApiError && showError(this.#form, error);
    this.#problem.hidden = isPlaced;
    this.#problem.textContent = isPlaced ? "" : messageOf(error);
  }
}
