/** How large the plan is and how long it will take, kept up to date while the form is filled in; and the start. */

import { fill, h } from "../shared/dom.js";
import { bytes, count } from "../shared/format.js";
import { sweeps } from "./api.js";
import { duration } from "./bar.js";
import { clearErrors, showError } from "./fields.js";
import { toast } from "../shared/toast.js";

const COUNT_AFTER_MS = 150;
const MEASURE_AFTER_MS = 700;
const ASK_AGAIN_MS = 3000;

/**
 * @param {HTMLFormElement} form
 * @param {() => object} read What is asked for now.
 * @param {{sized: (estimate: object) => void}} on
 */
export function sizeCard(form, read, on) {
  const runs = h("p", { class: "figure" }, "–");
  const words = h("div", { class: "size-words" });
  const time = h("p", { class: "figure", data: { role: "time" } }, "–");
  const jobs = h("p", { class: "hint", data: { role: "jobs" } });
  const problem = h("p", { class: "note", hidden: true });
  const button = h("button", { type: "button", class: "primary", on: { click: () => start() } }, "Start the sweep");
  const element = h("aside", { class: "plan-size", "aria-label": "Size" }, h("div", { role: "status" }, runs, words), h("div", {}, time, jobs), problem, button);
  let asked = 0;
  let timers = [];

  function changed() {
    asked += 1;
    timers.forEach(clearTimeout);
    element.classList.add("stale");
    timers = [setTimeout(look, COUNT_AFTER_MS, asked, false), setTimeout(look, MEASURE_AFTER_MS, asked, true)];
  }

  async function look(mine, measure) {
    if (measure && !button.disabled) {
      fill(time, h("small", {}, "measuring the time"));
      fill(jobs);
    }
    try {
      const found = await sweeps.estimate(read(), measure);
      if (mine === asked) show(found);
    } catch (error) {
      if (mine === asked) refuse(error);
    }
  }

  function show(found) {
    clearErrors(form);
    element.classList.remove("stale");
    on.sized(found);
    const methods = found.runs / found.conditions;
    fill(runs, found.runs.toLocaleString("en-GB"), " ", h("small", {}, found.runs === 1 ? "run" : "runs"));
    fill(words, h("p", {}, `${count(found.conditions, "condition")} × ${count(methods, "run")}`), h("p", { class: "hint" }, `${count(found.cells, "cell")} a map, at most ${bytes(found.bytes)}`));
    if (found.seconds === null) return dress(found);
    fill(time, duration(found.seconds), " ", h("small", {}, "to compute"));
    fill(jobs, `Measured on a few runs, for ${found.jobs === 1 ? "1 process" : `${found.jobs} processes`}; some seconds to start come on top.`);
    return dress(found);
  }

  /** Say why the sweep cannot be started now, if it cannot. */
  function dress(found) {
    problem.hidden = found.problem === null;
    problem.textContent = found.problem ?? "";
    button.disabled = found.problem !== null;
    // A place may become free, or room on the disk.
    if (found.problem !== null) timers.push(setTimeout(look, ASK_AGAIN_MS, asked, false));
  }

  function refuse(error) {
    element.classList.add("stale");
    fill(time, "–");
    fill(jobs);
    button.disabled = error.status === 422;
    const placed = showError(form, error);
    problem.hidden = placed;
    problem.textContent = placed ? "" : error.message;
  }

  async function start() {
    button.disabled = true;
    timers.forEach(clearTimeout);
    asked += 1;
    try {
      const sweep = await sweeps.begin(read());
      location.assign(sweep.page);
    } catch (error) {
      refuse(error);
      button.disabled = false;
      if (error.field === undefined) toast(error.message, { kind: "error" });
    }
  }

  return { element, changed, start };
}
