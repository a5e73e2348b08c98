/**
 * What a run can be taken away as: buttons by kind of thing, and below them what is being written. The server tells how far
 * it is; when a file is there it is fetched, unless it was stopped.
 */

import { messageOf } from "./api.js";
import { fill, h } from "./dom.js";
import { cancelJob, followJob } from "./jobs.js";
import { attempt, toast } from "./toast.js";

/** @import { ExportJob, FileKind } from "./messages.js" */

/** @typedef {{id: string, title: string}} Plot */

/** @typedef {(name: string, plot: string) => Promise<ExportJob>} Begin Has the server write a file; all plots if that is "". */

/** @type {[FileKind["group"], string][]} In the order in which they are listed. */
const GROUPS = [
  ["numbers", "Numbers of all frames"],
  ["boxes", "Boxes that are believed"],
  ["truth", "Boxes that are true"],
  ["film", "Moving pictures"],
  ["plots", "Plots"],
  ["documents", "The run and its sources"],
  ["model", "Of this frame"],
];

/**
 * The lists, and how to fill them anew; what is being written stays.
 *
 * @param {Begin} begin
 */
export function exportLists(begin) {
  const lists = h("div", {});
  const writing = h("ul", { class: "export-jobs", "aria-label": "Being written" });
  const draw = (/** @type {readonly FileKind[]} */ offered, /** @type {readonly Plot[]} */ plots) => {
    const choice = plotChoice(plots);
    fill(
      lists,
      GROUPS.map(([group, title]) => {
        const some = offered.filter((one) => one.group === group);
        const plot = () => (group === "plots" ? choice.value : "");
        const buttons = some.map((one) => button(one, () => attempt(async () => follow(await begin(one.name, plot()), writing))));
        const words = { class: "export-group", role: "group", "aria-label": title };
        const isChosen = group === "plots" && plots.length > 0;
        return some.length > 0 && h("div", words, h("h3", {}, title), h("div", { class: "export-row" }, isChosen && choice, buttons));
      }),
    );
  };
  return { element: h("div", { class: "exports" }, lists, writing), draw };
}

/** @param {readonly Plot[]} plots */
function plotChoice(plots) {
  const options = [{ id: "", title: "All plots" }, ...plots].map(({ id, title }) => h("option", { value: id }, title));
  return h("select", { "aria-label": "Which plot" }, options);
}

/**
 * @param {FileKind} offered
 * @param {() => void} press
 */
function button({ name, title, short }, press) {
  return h("button", { type: "button", title, data: { export: name }, on: { click: press } }, short || title);
}

/**
 * Show how far a file is, and fetch it when it is there.
 *
 * @param {ExportJob} begun
 * @param {HTMLElement} writing Where what is being written is listed.
 */
async function follow(begun, writing) {
  const wanted = new AbortController();
  const meter = h("progress", { max: 1, "aria-label": `How far ${begun.name} is` });
  const words = h("span", { class: "grow" }, begun.name);
  const stop = () => {
    wanted.abort();
    row.remove();
    cancelJob(begun.id);
  };
  const row = h("li", { data: { writing: begun.id } }, words, meter, h("button", { type: "button", class: "quiet", on: { click: stop } }, "Stop"));
  writing.append(row);
  try {
    const tell = (/** @type {ExportJob|null} */ now) => {
      if (now !== null && now.total > 0) meter.value = now.done / now.total;
    };
    const job = await followJob(begun, tell, wanted.signal);
    if (job === null) return;
    if (job.result === null) throw new Error(job.error ?? `${job.name} could not be written`);
    h("a", { href: job.result.address, download: job.name }).click();
  } catch (error) {
    toast(messageOf(error), { kind: "error" });
  } finally {
    row.remove();
  }
}
