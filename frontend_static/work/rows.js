/** One line of a list for each thing that a person has: its name, its outcome, and its actions. */

import { START } from "../shared/address.js";
import { api } from "../shared/api.js";
import { askName, confirmLoss } from "../shared/dialog.js";
import { Exports } from "../shared/exports.js";
import { bytes, count, moment } from "../shared/format.js";
import { IconButton } from "../shared/icons.js";
import { Thumbnail } from "../shared/page.js";
import { attempt } from "../shared/toast.js";
import { Popover } from "../session/popover.js";
import { trackerTitle } from "../session/timeline.js";
import { shortTitle, sweeps } from "../sweep/api.js";
import { h, html, useSignal } from "../vendor/preact.js";

/** @import { ExportsPublic, RunPublic, SavedComparisonPublic, SessionPublic, SweepPublic, UploadPublic, WorkPublic } from "../shared/messages.js" */
/** @import { Child } from "../vendor/preact.js" */

/** @typedef {"sessions"|"runs"|"comparisons"|"sweeps"|"uploads"} Kind */

/**
 * A thing as its line shows it.
 *
 * @typedef {object} Item
 * @property {string} id
 * @property {string} name
 * @property {string} anchor In the page's address.
 * @property {string|null} picture Its address, where it has one.
 * @property {Child} title
 * @property {string[]} facts The empty ones are left out.
 * @property {Child} ways What leads to it.
 * @property {((name: string) => Promise<unknown>)|null} rename
 * @property {() => Promise<unknown>} remove
 */

/** @typedef {{verb: string, noun: string, loss: string}} Removal How one or more things of a kind end, and what is lost then. */

/** @type {Record<Kind, Removal>} */
export const REMOVALS = {
  sessions: { verb: "End", noun: "session", loss: "Anything you have not saved is lost." },
  runs: { verb: "Delete", noun: "run", loss: "What you have not downloaded is lost for good." },
  comparisons: { verb: "Delete", noun: "comparison", loss: "The runs themselves stay where they are." },
  sweeps: { verb: "Delete", noun: "sweep", loss: "Runs and maps that you have not downloaded are lost for good." },
  uploads: { verb: "Delete", noun: "upload", loss: "The server deletes the recording. Sessions and saved runs of it cannot be computed any more." },
};

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
 * @returns {Item}
 */
function sessionItem(session) {
  const { id, name, page, created } = session;
  const doing = session.goal === null ? SESSION_STATES[session.state] : "computing";
  const experiment = name === session.title ? "" : session.title;
  return {
    id, name,
    anchor: `session-${id}`,
    picture: session.thumbnail,
    title: html`<a class="row-title" href=${page}>${name} · ${trackerTitle(session, session.tracker)}</a>`,
    facts: [experiment, `seed ${session.recipe.seed}`, `frame ${session.position} / ${session.frames}`, doing, moment(created)],
    ways: html`<a class="button" href=${page}>Open</a>`,
    rename: (to) => api.renameSession(id, to),
    remove: () => api.end(id),
  };
}

/**
 * @param {RunPublic} run
 * @returns {Item}
 */
function runItem(run) {
  const { id, title, created } = run;
  const open = async () => {
    const session = await attempt(() => api.open(id));
    if (session) location.assign(session.page);
  };
  return {
    id,
    name: title,
    anchor: `run-${id}`,
    picture: run.thumbnail,
    title: html`<span class="row-title">${title}</span>`,
    facts: [run.outcome, reproduced(run.summary), `seed ${run.seed}`, moment(created)],
    ways: [html`<button type="button" onClick=${open}>Open</button>`, h(Files, { run })],
    rename: (to) => api.renameRun(id, to),
    remove: () => api.remove(id),
  };
}

/** @param {{run: RunPublic}} props The file of a run itself, and all that it can be written as. */
function Files({ run: { id, title } }) {
  const found = useSignal(/** @type {ExportsPublic|null} */ (null));
  const look = () => attempt(async () => (found.value ??= await api.exportsOfRun(id)));
  const begin = (/** @type {string} */ name, /** @type {string} */ plot) => api.exportRun(id, name, plot);
  const own = html`<a class="button quiet grow" href=${api.downloadAddress(id)} download="">The saved run, to open it again (.pft)</a>`;
  const content = html`<section>
    <h2>Take away</h2>
    <ul class="menu-list"><li>${own}</li></ul>
    ${found.value && h(Exports, { offered: found.value.exports, plots: found.value.plots, begin })}
  </section>`;
  return h(Popover, { label: `Download ${title}`, title: "Download", words: "Download", content, onClick: look });
}

/**
 * @param {SavedComparisonPublic} comparison
 * @returns {Item}
 */
function comparisonItem({ id, title, experiments, trackers, created, page }) {
  return {
    id,
    name: title,
    anchor: `comparison-${id}`,
    picture: null,
    title: html`<a class="row-title" href=${page}>${title}</a>`,
    facts: [experiments.join(", "), count(trackers.length, "run"), moment(created)],
    ways: html`<a class="button" href=${page}>Open</a>`,
    rename: (to) => api.renameComparison(id, to),
    remove: () => api.removeComparison(id),
  };
}

/**
 * @param {SweepPublic} sweep
 * @returns {Item}
 */
function sweepItem({ id, title, page, trackers, outcome, state, created, done, runs }) {
  const methods = trackers.map((tracker) => shortTitle(tracker.title)).join(", ");
  const meter = html`<progress class="row-meter" max="1" value=${done / runs} aria-label=${`${title}, runs done`}></progress>`;
  return {
    id,
    name: title,
    anchor: `sweep-${id}`,
    picture: null,
    title: html`<a class="row-title" href=${page}>${title}</a>`,
    facts: [methods, outcome, SWEEP_STATES[state], moment(created)],
    ways: [state === "running" && meter, html`<a class="button" href=${page}>Open</a>`],
    rename: null,
    remove: () => sweeps.remove(id),
  };
}

/**
 * @param {UploadPublic} upload
 * @returns {Item}
 */
function uploadItem(upload) {
  const { id, name } = upload;
  const page = `${START}#upload/${encodeURIComponent(id)}`;
  const size = upload.width > 0 ? `${upload.width} × ${upload.height} px` : "";
  return {
    id, name,
    anchor: `upload-${id}`,
    picture: api.pictureAddress(id, 0),
    title: html`<a class="row-title" href=${page}>${name}</a>`,
    facts: [upload.kind, count(upload.frames, "frame"), size, bytes(upload.size_bytes), moment(upload.created)],
    ways: html`<a class="button" href=${page}>Track a target in it</a>`,
    rename: null,
    remove: () => api.removeUpload(id),
  };
}

/**
 * All things of one kind.
 *
 * @param {WorkPublic} work
 * @param {Kind} kind
 * @returns {Item[]}
 */
export function itemsOf(work, kind) {
  switch (kind) {
    case "sessions":
      return work.sessions.map(sessionItem);
    case "runs":
      return work.runs.map(runItem);
    case "comparisons":
      return work.comparisons.map(comparisonItem);
    case "sweeps":
      return work.sweeps.map(sweepItem);
    default:
      return work.uploads.map(uploadItem);
  }
}

/** @param {{kind: Kind, item: Item, isChosen: boolean, toggle: () => void, again: () => Promise<void>}} props `again` lists everything anew. */
export function Row({ kind, item, isChosen, toggle, again }) {
  const { id, name, anchor, picture, title, facts, ways, rename } = item;
  const renaming = rename && (async () => {
    const answer = await askName(`Rename ${name}`, name);
    if (answer !== null) await attempt(() => rename(answer).then(again));
  });
  const label = `${REMOVALS[kind].verb} ${name}`;
  return html`<li class="row" id=${anchor} ...${{ [`data-${REMOVALS[kind].noun}`]: id }}>
    <input type="checkbox" checked=${isChosen} aria-label=${`Choose ${name}`} onChange=${toggle} />
    ${picture !== null && html`<div class="row-thumb">${h(Thumbnail, { address: picture })}</div>`}
    <div class="row-words">${title}<span class="hint">${facts.filter(Boolean).join(", ")}</span></div>
    <div class="row-actions">
      ${ways}
      ${renaming && h(IconButton, { name: "rename", title: `Rename ${name}`, run: renaming })}
      ${h(IconButton, { name: "trash", title: label, run: () => remove(kind, [item], again) })}
    </div>
  </li>`;
}

/**
 * End or delete some things, once a person has confirmed it.
 *
 * @param {Kind} kind
 * @param {readonly Item[]} items
 * @param {() => Promise<void>} again
 */
export async function remove(kind, items, again) {
  const { verb, noun, loss } = REMOVALS[kind];
  const isOne = items.length === 1;
  const names = items.map(({ name }) => name).join(", ");
  const question = {
    title: isOne ? `${verb} this ${noun}?` : `${verb} these ${count(items.length, noun)}?`,
    text: `${names}: ${loss[0].toLowerCase()}${loss.slice(1)}`,
    action: isOne ? `${verb} it` : `${verb} them`,
  };
  if (!(await confirmLoss(question))) return;
  for (const item of items) await attempt(item.remove);
  await again();
}

/**
 * Whether an imported run has the same numbers here as where it was saved.
 *
 * @param {RunPublic["summary"]} summary
 */
function reproduced(summary) {
  if (typeof summary.reproduced !== "boolean") return "";
  const differs = /** @type {{first_frame?: number}|undefined} */ (summary.differs);
  const from = typeof differs?.first_frame === "number" ? `, from frame ${differs.first_frame} on` : "";
  return summary.reproduced ? "same numbers as in its file" : `other numbers than in its file${from}`;
}
