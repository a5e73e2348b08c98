/**
 * What a run can be taken away as: buttons by kind of thing, and below them what is being written. Something that takes
 * a while is written on the server, which tells how far it is; when it is there it is fetched, unless it was stopped.
 */

import { api, messageOf } from "./api.js";
import { fill, h } from "./dom.js";
import { followJob, onMeter } from "./jobs.js";
import { attempt, toast } from "./toast.js";

/** @import { ExportJobPublic, ExportPublic } from "./messages.js" */

/** @typedef {{id: string, title: string}} PlotChoice */

/**
 * How a run's files are come by.
 *
 * @typedef {object} Way
 * @property {(name: string, plot: string) => Promise<ExportJobPublic>} begin Has the server write one; all plots if that is "".
 * @property {(name: string, plot: string) => Promise<{name: string, content: Blob}>} [fetch] Brings one that is quick at once.
 */

/** @type {[ExportPublic["group"], string][]} In the order in which they are listed. */
const GROUPS = [
  ["numbers", "Numbers of all frames"],
  ["boxes", "Boxes that are believed"],
  ["truth", "Boxes that are true"],
  ["film", "Moving pictures"],
  ["plots", "Plots"],
  ["documents", "The run and its sources"],
  ["model", "Of this frame"],
];

/** How long a file is kept for the browser to save it. */
const KEPT_MS = 60_000;

/**
 * The lists, and how to fill them anew; what is being written stays.
 *
 * @param {Way} way
 */
export function exportLists(way) {
  const lists = h("div", {});
  const writing = h("ul", { class: "export-jobs", "aria-label": "Being written" });
  const draw = (/** @type {readonly ExportPublic[]} */ offered, /** @type {readonly PlotChoice[]} */ plots) => {
    const choice = plotChoice(plots);
    fill(
      lists,
      GROUPS.map(([group, title]) => {
        const some = offered.filter((one) => one.group === group);
        const plot = () => (group === "plots" ? choice.value : "");
        const buttons = some.map((one) => button(one, () => take(one, plot(), way, writing)));
        const words = { class: "export-group", role: "group", "aria-label": title };
        const isChosen = group === "plots" && plots.length > 0;
        return some.length > 0 && h("div", words, h("h3", {}, title), h("div", { class: "export-row" }, isChosen && choice, buttons));
      }),
    );
  };
  return { element: h("div", { class: "exports" }, lists, writing), draw };
}

/** @param {readonly PlotChoice[]} plots */
function plotChoice(plots) {
  const options = [{ id: "", title: "All plots" }, ...plots].map(({ id, title }) => h("option", { value: id }, title));
  return h("select", { "aria-label": "Which plot" }, options);
}

/**
 * @param {ExportPublic} offered
 * @param {() => void} press
 */
function button({ name, title, short }, press) {
  return h("button", { type: "button", title, data: { export: name }, on: { click: press } }, short || title);
}

/**
 * @param {ExportPublic} offered
 * @param {string} plot
 * @param {Way} way
 * @param {HTMLElement} writing Where what is being written is listed.
 */
function take(offered, plot, way, writing) {
  return attempt(async () => {
    if (way.fetch && !offered.slow) keep(await way.fetch(offered.name, plot));
    else await follow(await way.begin(offered.name, plot), writing);
  });
}

/**
 * Show how far a file is, and fetch it when it is there.
 *
 * @param {ExportJobPublic} begun
 * @param {HTMLElement} writing
 */
async function follow(begun, writing) {
  let isWanted = true;
  const meter = h("progress", { max: 1, "aria-label": `How far ${begun.name} is` });
  const words = h("span", { class: "grow" }, begun.name);
  const stop = () => {
    isWanted = false;
    row.remove();
    attempt(() => api.cancelExport(begun.id));
  };
  const row = h("li", { data: { writing: begun.id } }, words, meter, h("button", { type: "button", class: "quiet", on: { click: stop } }, "Stop"));
  writing.append(row);
  try {
    const job = await followJob(begun, "writing", api.exporting, onMeter(meter), () => isWanted);
    if (job === null) return;
    if (job.state === "failed") throw new Error(job.message ?? `${job.name} could not be written`);
    h("a", { href: job.file, download: job.name }).click();
  } catch (error) {
    toast(messageOf(error), { kind: "error" });
  } finally {
    row.remove();
  }
}

/** @param {{name: string, content: Blob}} file */
function keep({ name, content }) {
  const href = URL.createObjectURL(content);
  h("a", { href, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(href), KEPT_MS);
}
