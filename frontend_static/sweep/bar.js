/** How far a sweep is, and what can be done with it. */

import { START } from "../shared/address.js";
import { confirmLoss } from "../shared/dialog.js";
import { fill, h } from "../shared/dom.js";
import { count, duration } from "../shared/format.js";
import { icon, iconButton } from "../shared/icons.js";
import { newSweep } from "../shared/share_link.js";
import { sweeps } from "./api.js";
import { attempt } from "../shared/toast.js";

/** @import { Child } from "../shared/elements.js" */
/** @import { SweepPublic } from "../shared/messages.js" */
/** @import { SweepStore } from "./store.js" */

const FORMATS = [
  ["parquet", "All runs, Parquet"],
  ["csv", "All runs, CSV"],
  ["html", "Report, one HTML page"],
  ["png", "Maps, PNG in an archive"],
  ["svg", "Maps, SVG in an archive"],
];

/**
 * @param {HTMLElement} root
 * @param {SweepStore} store
 */
export function bar(root, store) {
  const meter = h("progress", { max: 1, "aria-label": "Runs done" });
  const words = h("p", { class: "bar-words", role: "status" });
  const reason = h("p", { class: "note", hidden: true });
  const actions = h("div", { class: "row-actions" });
  const downloads = downloadMenu(store);
  fill(root, h("div", { class: "bar-line" }, h("div", { class: "bar-grow" }, meter, words), actions), reason);
  let state = "";
  store.on(["sweep"], () => {
    const { known: sweep } = store;
    meter.value = sweep.done / sweep.runs;
    meter.hidden = sweep.state === "done";
    fill(words, sentence(sweep));
    reason.hidden = !(sweep.state === "stopped" && sweep.message);
    reason.textContent = sweep.message ?? "";
    if (state !== `${sweep.state} ${sweep.done > 0}`) {
      state = `${sweep.state} ${sweep.done > 0}`;
      fill(actions, buttons(store, downloads));
    }
  });
}

/**
 * @param {SweepPublic} sweep
 * @returns {Child}
 */
function sentence(sweep) {
  const all = count(sweep.runs, "run");
  if (sweep.state === "done") return [h("strong", {}, "Complete"), `, ${all} in ${duration(sweep.seconds)}`];
  const done = `${sweep.done.toLocaleString("en-GB")} of ${all}`;
  if (sweep.state === "stopped") return [h("strong", {}, "Stopped"), `, ${done} are there`];
  if (sweep.rate === null) return [h("strong", {}, sweep.done === 0 ? "Starting" : "Running"), `, ${done}`];
  return [h("strong", {}, done), `, ${rate(sweep.rate)}, about ${duration(sweep.seconds_left)} left`];
}

/**
 * @param {SweepStore} store
 * @param {Child} downloads
 */
function buttons(store, downloads) {
  const { known: sweep } = store;
  const act = (/** @type {() => Promise<SweepPublic>} */ work) => async () => {
    const answer = await attempt(work);
    if (answer) store.take(answer);
  };
  const [cancel, resume] = [act(() => sweeps.cancel(sweep.id)), act(() => sweeps.resume(sweep.id))];
  const { experiment, trials, frames, seed, parameters, loss_probability } = sweep;
  const axes = sweep.axes.map(({ name, values }) => ({ name, values }));
  const again = { experiment, axes, trackers: sweep.trackers.map(({ id }) => id), trials, frames, seed, parameters, loss_probability };
  return [
    sweep.state === "running" && h("button", { type: "button", data: { role: "cancel" }, on: { click: cancel } }, "Cancel"),
    sweep.state === "stopped" && h("button", { type: "button", class: "primary", data: { role: "resume" }, on: { click: resume } }, "Resume"),
    sweep.done > 0 && downloads,
    !sweep.recording && h("a", { class: "button", href: newSweep(again), title: "Fill the form with this plan" }, "Change and repeat"),
    iconButton("trash", "Delete this sweep", () => remove(sweep)),
  ];
}

/** @param {SweepPublic} sweep */
async function remove(sweep) {
  const text = `${sweep.title} and its ${count(sweep.done, "run")} are lost for good, unless you downloaded them.`;
  if (!(await confirmLoss({ title: "Delete this sweep?", text, action: "Delete it" }))) return;
  if ((await attempt(() => sweeps.remove(sweep.id).then(() => true))) === true) location.assign(START);
}

/** @param {SweepStore} store */
function downloadMenu(store) {
  const menu = h("div", { class: "menu", popover: "auto", id: "downloads" });
  const button = h("button", { type: "button", popovertarget: "downloads", data: { role: "download" } }, icon("save"), "Download");
  menu.addEventListener("toggle", (event) => {
    if (event.newState !== "open") return;
    const { right, bottom } = button.getBoundingClientRect();
    Object.assign(menu.style, { left: `${Math.max(8, right - 240)}px`, top: `${bottom + 4}px`, width: "240px" });
    const links = FORMATS.map(([format, words]) => {
      const href = sweeps.downloadAddress(store.known.id, format);
      return h("a", { class: "button quiet grow", href, download: "", on: { click: () => menu.hidePopover() } }, words);
    });
    fill(menu, h("ul", { class: "menu-list" }, links.map((link) => h("li", {}, link))));
  });
  return [button, menu];
}

/**
 * 83.2 -> "83 runs/s".
 *
 * @param {number} value
 */
export function rate(value) {
  return value >= 10 ? `${Math.round(value).toLocaleString("en-GB")} runs/s` : `${value.toFixed(1)} runs/s`;
}
