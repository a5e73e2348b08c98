/** One line of a list for each thing that somebody has: what it is, what came of it, and what can be done with it. */

import { START } from "../shared/address.js";
import { api } from "../shared/api.js";
import { askName, confirmLoss } from "../shared/dialog.js";
import { h } from "../shared/dom.js";
import { exportLists } from "../shared/exports.js";
import { bytes, count, moment } from "../shared/format.js";
import { iconButton } from "../shared/icons.js";
import { thumbnail } from "../shared/thumbnail.js";
import { attempt } from "../shared/toast.js";
import { popover } from "../session/popover.js";
import { trackerTitle } from "../session/timeline.js";
import { sweeps } from "../sweep/api.js";

/** @import { Child } from "../shared/elements.js" */
/** @import { Question } from "../shared/dialog.js" */
/** @import { RunPublic, SavedComparisonPublic, SessionPublic, SweepPublic, UploadPublic } from "../shared/messages.js" */

/** @typedef {() => Promise<void>} Again Lists everything anew. */
/** @typedef {{has: (run: string) => boolean, isFull: boolean, toggle: (run: string) => void}} Choice Runs that are chosen to be compared. */

/** @type {Record<SessionPublic["state"], string>} */
const SESSION_STATES = {
  starting: "starting",
  ready: "paused",
  playing: "playing",
  ended: "at the end",
  suspended: "sleeping",
  crashed: "stopped, can be restarted",
  closed: "ended",
};
const SWEEP_STATES = { running: "running", stopped: "stopped, can be resumed", done: "complete" };

/**
 * @param {SessionPublic} session
 * @param {Again} again
 */
export function sessionRow(session, again) {
  const doing = session.goal === null ? SESSION_STATES[session.state] : "computing";
  const experiment = session.name === session.title ? "" : session.title;
  const facts = [experiment, `seed ${session.recipe.seed}`, `frame ${session.position} / ${session.frames}`, doing, moment(session.created)];
  const question = { title: "End this session?", text: "Anything you have not saved is lost.", action: "End it" };
  const title = link(session.page, `${session.name} · ${trackerTitle(session, session.tracker)}`);
  return row({ session: session.id }, `session-${session.id}`, session.thumbnail, title, facts, [
    link(session.page, "Open", "button"),
    renaming(session.name, (name) => api.renameSession(session.id, name), again),
    removal(`End ${session.name}`, question, () => api.end(session.id), again),
  ]);
}

/**
 * @param {RunPublic} run
 * @param {Again} again
 * @param {Choice} choice
 */
export function runRow(run, again, choice) {
  const open = async () => {
    const session = await attempt(() => api.open(run.id));
    if (session) location.assign(session.page);
  };
  const facts = [run.outcome, reproduced(run.summary), `seed ${run.seed}`, moment(run.created)];
  const question = { title: "Delete this run?", text: `${run.title} is lost for good, unless you downloaded it.`, action: "Delete it" };
  const chosen = choice.has(run.id);
  const box = h("input", { type: "checkbox", checked: chosen, disabled: choice.isFull && !chosen, on: { change: () => choice.toggle(run.id) } });
  return row({ run: run.id }, `run-${run.id}`, run.thumbnail, h("span", {}, run.title), facts, [
    h("label", { class: "row-choice", title: "Choose two to four runs to compare them" }, box, "Compare"),
    h("button", { type: "button", on: { click: open } }, "Open"),
    filesOf(run),
    renaming(run.title, (title) => api.renameRun(run.id, title), again),
    removal(`Delete ${run.title}`, question, () => api.remove(run.id), again),
  ]);
}

/**
 * The file of a run itself, and all that it can be written as.
 *
 * @param {RunPublic} run
 */
function filesOf({ id, title }) {
  const lists = exportLists((name, plot) => api.exportRun(id, name, plot));
  const own = h("a", { class: "button quiet grow", href: api.downloadAddress(id), download: "" }, "The saved run, to open it again (.pft)");
  const button = h("button", { type: "button", "aria-label": `Download ${title}` }, "Download");
  const root = popover(button, h("section", {}, h("h2", {}, "Take away"), h("ul", { class: "menu-list" }, h("li", {}, own)), lists.element));
  button.addEventListener("click", () => attempt(async () => {
    const { exports, plots } = await api.exportsOfRun(id);
    lists.draw(exports, plots);
  }), { once: true });
  return root;
}

/**
 * @param {SavedComparisonPublic} comparison
 * @param {Again} again
 */
export function comparisonRow({ id, title, experiments, trackers, created, page }, again) {
  const facts = [experiments.join(", "), count(trackers.length, "run"), moment(created)];
  const question = { title: "Delete this comparison?", text: `${title} is deleted; the runs themselves stay where they are.`, action: "Delete it" };
  return row({ comparison: id }, `comparison-${id}`, null, link(page, title), facts, [
    link(page, "Open", "button"),
    renaming(title, (name) => api.renameComparison(id, name), again),
    removal(`Delete ${title}`, question, () => api.removeComparison(id), again),
  ]);
}

/**
 * @param {SweepPublic} sweep
 * @param {Again} again
 */
export function sweepRow(sweep, again) {
  const methods = sweep.trackers.map(({ title }) => /\(([^)]+)\)$/.exec(title)?.[1] ?? title).join(", ");
  const facts = [methods, sweep.outcome, SWEEP_STATES[sweep.state], moment(sweep.created)];
  const text = `${sweep.title} and everything computed of it are lost for good, unless you downloaded them.`;
  return row({ sweep: sweep.id }, `sweep-${sweep.id}`, null, link(sweep.page, sweep.title), facts, [
    sweep.state === "running" && h("progress", { class: "row-meter", max: 1, value: sweep.done / sweep.runs, "aria-label": `${sweep.title}, runs done` }),
    link(sweep.page, "Open", "button"),
    removal(`Delete ${sweep.title}`, { title: "Delete this sweep?", text, action: "Delete it" }, () => sweeps.remove(sweep.id), again),
  ]);
}

/**
 * @param {UploadPublic} upload
 * @param {Again} again
 */
export function uploadRow(upload, again) {
  const page = `${START}#upload/${encodeURIComponent(upload.id)}`;
  const size = upload.width > 0 ? `${upload.width} × ${upload.height} px` : "";
  const facts = [upload.kind, count(upload.frames, "frame"), size, bytes(upload.size_bytes), moment(upload.created)];
  const text = `${upload.name} is deleted from this server. Sessions and saved runs of it cannot be computed any more.`;
  return row({ upload: upload.id }, `upload-${upload.id}`, api.pictureAddress(upload.id, 0), link(page, upload.name), facts, [
    link(page, "Track a target in it", "button"),
    removal(`Delete ${upload.name}`, { title: "Delete this upload?", text, action: "Delete it" }, () => api.removeUpload(upload.id), again),
  ]);
}

/**
 * @param {Record<string, string>} data
 * @param {string} id In addresses.
 * @param {string|null} picture Its address, where it has one.
 * @param {HTMLElement} title
 * @param {string[]} facts The empty ones are left out.
 * @param {Child[]} actions
 */
function row(data, id, picture, title, facts, actions) {
  title.classList.add("row-title");
  return h(
    "li",
    { class: "row", id, data },
    picture !== null && h("div", { class: "row-thumb" }, thumbnail(picture)),
    h("div", { class: "row-words" }, title, h("span", { class: "hint" }, facts.filter(Boolean).join(", "))),
    h("div", { class: "row-actions" }, actions),
  );
}

/**
 * @param {string} href
 * @param {string} text
 * @param {string} [look]
 */
function link(href, text, look) {
  return h("a", { href, class: look }, text);
}

/**
 * Whether a run that was brought in came to the numbers here that it had where it was saved.
 *
 * @param {RunPublic["summary"]} summary
 */
function reproduced(summary) {
  if (typeof summary.reproduced !== "boolean") return "";
  const differs = /** @type {{first_frame?: number}|undefined} */ (summary.differs);
  const from = typeof differs?.first_frame === "number" ? `, from frame ${differs.first_frame} on` : "";
  return summary.reproduced ? "same numbers as in its file" : `other numbers than in its file${from}`;
}

/**
 * @param {string} name
 * @param {(name: string) => Promise<unknown>} rename
 * @param {Again} again
 */
function renaming(name, rename, again) {
  const press = async () => {
    const answer = await askName(`Rename ${name}`, name);
    if (answer !== null) await attempt(() => rename(answer).then(again));
  };
  return iconButton("rename", `Rename ${name}`, press);
}

/**
 * @param {string} label
 * @param {Question} question
 * @param {() => Promise<unknown>} remove
 * @param {Again} again
 */
function removal(label, question, remove, again) {
  const press = async () => {
    if (await confirmLoss(question)) await attempt(() => remove().then(again));
  };
  return iconButton("trash", label, press);
}
