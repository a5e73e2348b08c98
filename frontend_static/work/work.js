/** My work: running sessions, saved runs, comparisons, sweeps and uploads, found by words; the address holds the search. */

import { trackerTitle } from "../session/steering.js";
import { addressOf, messageOf, request, START } from "../shared/api.js";
import { linkToReferences } from "../shared/comparison.js";
import { askName, confirmLoss } from "../shared/dialog.js";
import { attempt, IconButton, Popover } from "../shared/dom.js";
import { Exports } from "../shared/exports.js";
import { bytes, count, moment } from "../shared/format.js";
import { Failed, showPage, Thumbnail } from "../shared/page.js";
import { NewestRequest, throttle } from "../shared/timing.js";
import { shortTitle } from "../sweep/store.js";
import { h, html, signal, useEffect, useRef, useSignal } from "../vendor/preact.js";

/** @import { ExportsPublic, RunPublic, SavedComparisonPublic, SessionPublic, SweepPublic, UploadPublic, WorkPublic } from "../shared/messages.js" */
/** @import { Child } from "../vendor/preact.js" */

// One line of a list for each item: its name, its outcome, and its actions.

/** @typedef {"sessions"|"runs"|"comparisons"|"sweeps"|"uploads"} Kind */

/** An item for its line.
 *
 * @typedef {object} Item
 * @property {string} id
 * @property {string} name
 * @property {string} [title] Title; by default the name.
 * @property {string} [page] Address of its page, if it has one.
 * @property {string} [open] Label of the link to its page.
 * @property {string} [picture] Address of its picture, if it has one.
 * @property {string[]} facts Facts; empty ones are left out.
 * @property {Child} [ways] Further buttons.
 * @property {(name: string) => Promise<unknown>} [rename]
 * @property {() => Promise<unknown>} remove
 */

/** States with another name on the page. @type {Partial<Record<SessionPublic["state"], string>>} */
const SESSION_STATES = {
  ready: "paused",
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
  const { id, name, page, thumbnail, created } = session;
  const doing = session.goal === null ? (SESSION_STATES[session.state] ?? session.state) : "computing";
  const experiment = name === session.title ? "" : session.title;
  return {
    id,
    name,
    title: `${name} · ${trackerTitle(session, session.tracker)}`,
    page,
    picture: thumbnail,
    facts: [experiment, `seed ${session.recipe.seed}`, `frame ${session.position} / ${session.frames}`, doing, moment(created)],
    rename: (to) => request("PATCH sessions/{session}", { session: id, body: { name: to } }),
    remove: () => request("DELETE sessions/{session}", { session: id }),
  };
}

/**
 * @param {RunPublic} run
 * @returns {Item}
 */
function runItem(run) {
  const { id, title, created } = run;
  const open = async () => {
    const session = await attempt(() => request("POST runs/{run}/open", { run: id }));
    if (session) location.assign(session.page);
  };
  return {
    id,
    name: title,
    picture: run.thumbnail,
    facts: [run.outcome, reproduced(run.summary), `seed ${run.seed}`, moment(created)],
    ways: [html`<button type="button" onClick=${open}>Open</button>`, h(Files, { run })],
    rename: (to) => request("PATCH runs/{run}", { run: id, body: { title: to } }),
    remove: () => request("DELETE runs/{run}", { run: id }),
  };
}

/** @param {{run: RunPublic}} props The file of a run, and its exports. */
function Files({ run: { id: run, title } }) {
  const found = useSignal(/** @type {ExportsPublic|null} */ (null));
  const look = () => attempt(async () => (found.value ??= await request("GET runs/{run}/exports", { run })));
  const begin = (/** @type {string} */ name, /** @type {string|undefined} */ plot) => request("POST runs/{run}/exports/{export}", { run, export: name, plot });
  const own = html`<a class="button quiet grow" href=${addressOf("GET runs/{run}/download", { run })} download="">The saved run, to open it again (.pft)</a>`;
  const content = html`<section>
    <h2>Export</h2>
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
    page,
    facts: [experiments.join(", "), count(trackers.length, "run"), moment(created)],
    rename: (to) => request("PATCH comparisons/saved/{saved}", { saved: id, body: { title: to } }),
    remove: () => request("DELETE comparisons/saved/{saved}", { saved: id }),
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
    page,
    facts: [methods, outcome, SWEEP_STATES[state], moment(created)],
    ways: state === "running" && meter,
    remove: () => request("DELETE sweeps/{sweep}", { sweep: id }),
  };
}

/**
 * @param {UploadPublic} upload
 * @returns {Item}
 */
function uploadItem({ id, name, kind, frames, width, height, size_bytes: size, created }) {
  return {
    id,
    name,
    page: `${START}#upload/${encodeURIComponent(id)}`,
    open: "Track a target in it",
    picture: addressOf("GET uploads/{upload}/frames/{frame}.jpg", { upload: id, frame: 0 }),
    facts: [kind, count(frames, "frame"), width > 0 ? `${width} × ${height} px` : "", bytes(size), moment(created)],
    remove: () => request("DELETE uploads/{upload}", { upload: id }),
  };
}

/** @param {{kind: Kind, item: Item, isChosen: boolean, toggle: () => void, again: () => Promise<void>}} props `again` reloads the list. */
function Row({ kind, item, isChosen, toggle, again }) {
  const { id, name, title = name, page, open = "Open", picture, facts, ways, rename } = item;
  const renaming = rename && (async () => {
    const answer = await askName(`Rename ${name}`, name);
    if (answer !== null) await attempt(() => rename(answer).then(again));
  });
  const noun = nounOf(kind);
  return html`<li class="row" id=${`${noun}-${id}`} ...${{ [`data-${noun}`]: id }}>
    <input type="checkbox" checked=${isChosen} aria-label=${`Choose ${name}`} onChange=${toggle} />
    ${picture && html`<div class="row-thumb">${h(Thumbnail, { address: picture })}</div>`}
    <div class="row-words">
      ${page ? html`<a class="row-title" href=${page}>${title}</a>` : html`<span class="row-title">${title}</span>`}
      <span class="hint">${facts.filter(Boolean).join(", ")}</span>
    </div>
    <div class="row-actions">
      ${ways}
      ${page && html`<a class="button" href=${page}>${open}</a>`}
      ${renaming && h(IconButton, { name: "rename", title: `Rename ${name}`, run: renaming })}
      ${h(IconButton, { name: "trash", title: `${verbOf(kind)} ${name}`, run: () => remove(kind, [item], again) })}
    </div>
  </li>`;
}

/** End or delete some items, once a person has confirmed it.
 *
 * @param {Kind} kind
 * @param {readonly Item[]} items
 * @param {() => Promise<void>} again
 */
async function remove(kind, items, again) {
  const [verb, noun, { loss }] = [verbOf(kind), nounOf(kind), ABOUT[kind]];
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

/** Whether an imported run has the same numbers here as when it was saved.
 *
 * @param {RunPublic["summary"]} summary
 */
function reproduced(summary) {
  if (typeof summary.reproduced !== "boolean") return "";
  const differs = /** @type {{first_frame?: number}|undefined} */ (summary.differs);
  const from = typeof differs?.first_frame === "number" ? `, from frame ${differs.first_frame} on` : "";
  return summary.reproduced ? "same numbers as in its file" : `other numbers than in its file${from}`;
}

/** @typedef {{words: string, show: Kind|null, limit: number}} Query The words to find, the one kind to list or null for all, and how many of each. */

const TYPING_MS = 250;
const MOST_COMPARED = 4;
/** Items of each kind if all kinds are listed, and further items at a time if only one kind is. */
const FEW = 6;
const MANY = 50;
const PLACEHOLDER = "Title, experiment, tracker, date or outcome";
/** The time zone of shown and searched dates. */
const ZONE = Intl.DateTimeFormat().resolvedOptions().timeZone;

/** The texts of a kind: the loss when its items end, and the hint for an empty list.
 *
 * @typedef {object} About
 * @property {string} title
 * @property {string} loss
 * @property {string} empty
 * @property {[words: string, href: string]} [way] Link of the hint; by default to choose an experiment.
 * @property {(work: WorkPublic) => Item[]} items
 */

/** @type {Record<Kind, About>} */
const ABOUT = {
  sessions: {
    title: "Running sessions",
    loss: "Anything you have not saved is lost.",
    empty: "No session is running. Start one with an experiment, and it is listed here until you end it.",
    items: ({ sessions }) => sessions.map(sessionItem),
  },
  runs: {
    title: "Saved runs",
    loss: "Files that you have not downloaded are deleted permanently.",
    empty: "No runs are saved yet. Save one on a session's page, and it is listed here.",
    items: ({ runs }) => runs.map(runItem),
  },
  comparisons: {
    title: "Comparisons",
    loss: "The runs themselves stay where they are.",
    empty: "No saved comparison yet. Compare runs, and save the comparison on that page.",
    items: ({ comparisons }) => comparisons.map(comparisonItem),
  },
  sweeps: {
    title: "Sweeps",
    loss: "Runs and maps that you have not downloaded are deleted permanently.",
    empty: "No sweeps yet. A sweep runs an experiment over many conditions and maps where each tracker succeeds.",
    way: ["New sweep", "sweep/new"],
    items: (work) => work.sweeps.map(sweepItem),
  },
  uploads: {
    title: "Uploads",
    loss: "The server deletes the recording. Sessions and saved runs of it cannot be computed any more.",
    empty: "No recording has been uploaded yet. Drop a video on the start page to track something in it.",
    way: ["Upload a video", START],
    items: ({ uploads }) => uploads.map(uploadItem),
  },
};
const KINDS = /** @type {Kind[]} */ (Object.keys(ABOUT));

/** @param {Kind} kind */
function nounOf(kind) {
  return kind.slice(0, -1);
}

/** @param {Kind} kind */
function verbOf(kind) {
  return kind === "sessions" ? "End" : "Delete";
}

/** The newest answer, or a sentence on why there is none, or nothing yet. */
const answered = signal(/** @type {WorkPublic|string|null} */ (null));
const wish = signal(parseQuery(new URLSearchParams(location.search)));
/** The chosen items in order, to compare, end or delete together; they may be from several searches. */
const chosen = signal(/** @type {readonly {kind: Kind, item: Item}[]} */ ([]));
const looking = new NewestRequest((/** @type {Query} */ { words: q, ...asked }) => request("GET work", { q, ...asked, zone: ZONE }), {
  answer: (found, _, isNewest) => isNewest && (answered.value = found),
  refused: (error) => (answered.value = messageOf(error)),
}, new AbortController().signal);
const load = () => looking.ask(wish.value);
const lookSoon = throttle(() => {
  history.replaceState(null, "", ownAddress(wish.value));
  void load();
}, TYPING_MS);

/**
 * @param {URLSearchParams} address
 * @returns {Query}
 */
function parseQuery(address) {
  const show = KINDS.find((kind) => kind === address.get("show")) ?? null;
  return { words: address.get("q") ?? "", show, limit: show === null ? FEW : MANY };
}

/**
 * @param {Query} wish
 * @returns {string} A page's address with the same search.
 */
function ownAddress({ words, show }) {
  const address = new URLSearchParams();
  if (show !== null) address.set("show", show);
  if (words.trim() !== "") address.set("q", words.trim());
  return address.size > 0 ? `work?${address}` : "work";
}

/** @param {Partial<Query>} change */
function search(change) {
  const before = wish.value;
  const { show = before.show } = change;
  const isOtherKind = show !== before.show;
  wish.value = { ...before, ...(isOtherKind && { limit: show === null ? FEW : MANY }), ...change };
  // Another kind of work is a step in the browser's history; a typed letter is not.
  if (isOtherKind) history.pushState(null, "", ownAddress(wish.value));
  lookSoon();
}

/** The whole page. */
function Work() {
  const field = useRef(/** @type {HTMLInputElement|null} */ (null));
  useEffect(() => void load().then(() => document.querySelector(":target")?.scrollIntoView({ block: "center" })), []);
  const work = answered.value;
  const found = work !== null && typeof work === "object" ? work.found : null;
  const type = (/** @type {Event & {currentTarget: HTMLInputElement}} */ { currentTarget }) => search({ words: currentTarget.value });
  const clear = () => {
    field.current?.focus();
    search({ words: "" });
  };
  return html`
    <form class="search" role="search" onSubmit=${(/** @type {Event} */ event) => event.preventDefault()}>
      <label>
        Search my work
        <input ref=${field} type="search" value=${wish.value.words} maxlength="200" placeholder=${PLACEHOLDER} onInput=${type} />
      </label>
      <div class="kinds" role="group" aria-label="Show">
        ${h(Chip, { kind: null, title: "All", amount: found && sum(KINDS, found) })}
        ${KINDS.map((kind) => h(Chip, { kind, title: ABOUT[kind].title, amount: found?.[kind] ?? null }))}
      </div>
    </form>
    ${found === null ? h(Without, { why: /** @type {string|null} */ (work) }) : h(Found, { work: /** @type {WorkPublic} */ (work), clear })}
  `;
}

/** @param {{kind: Kind|null, title: string, amount: number|null}} props */
function Chip({ kind, title, amount }) {
  return html`<button type="button" aria-pressed=${String(kind === wish.value.show)} onClick=${() => search({ show: kind })}>
    ${title}<output>${amount}</output>
  </button>`;
}

/** @param {{why: string|null}} props The reason why there is nothing to show. */
function Without({ why }) {
  if (why !== null) return h(Failed, { title: "Couldn't load your work", message: why, again: load });
  return [0, 1, 2].map(() => html`<section class="late" aria-hidden="true"><div class="bone short shimmer"></div><div class="bone shimmer"></div></section>`);
}

/** @param {{work: WorkPublic, clear: () => void}} props */
function Found({ work, clear }) {
  const { words, show } = wish.value;
  const isSearch = words.trim() !== "";
  const shown = KINDS.filter((kind) => (show === null ? !isSearch || work.found[kind] > 0 : kind === show));
  const found = sum(shown, work.found);
  const elsewhere = sum(KINDS, work.found);
  const nothing = html`<section>
    <p class="empty">
      Nothing matches all of these words: ${words.trim()}. Try fewer words.
      ${elsewhere > 0 && html`<button type="button" onClick=${() => search({ show: null })}>Show ${count(elsewhere, "result")} of other kinds</button>`}
      <button type="button" onClick=${clear}>Clear the search</button>
    </p>
  </section>`;
  return html`
    <p class="visually-hidden" role="status">${isSearch && `${count(found, "result")} found`}</p>
    ${isSearch && found === 0 ? nothing : shown.map((kind) => h(Section, { key: kind, kind, work }))}
  `;
}

/** @param {{kind: Kind, work: WorkPublic}} props */
function Section({ kind, work }) {
  const { title, empty, way: [words, href] = ["Choose an experiment", START] } = ABOUT[kind];
  const items = ABOUT[kind].items(work);
  const rest = work.found[kind] - items.length;
  const isAlone = wish.value.show === kind;
  const more = () => search(isAlone ? { limit: wish.value.limit + MANY } : { show: kind });
  const way = html`<a class="button" href=${href}>${words}</a>`;
  const rows = items.map((item) => {
    const isChosen = chosen.value.some((each) => each.item.id === item.id);
    const toggle = () => (chosen.value = isChosen ? without([item]) : [...chosen.value, { kind, item }]);
    return h(Row, { key: item.id, kind, item, isChosen, toggle, again: () => removed([item]) });
  });
  return html`<section aria-label=${title} data-part=${kind}>
    <header>
      <h2>${title}</h2>
      <div class="with-chosen">${h(WithChosen, { kind })} ${kind === "sweeps" && way}</div>
    </header>
    ${rows.length > 0 ? html`<ul class="rows">${rows}</ul>` : html`<p class="empty">${empty} ${kind !== "sweeps" && way}</p>`}
    ${rest > 0 && html`<button type="button" class="quiet" onClick=${more}>${isAlone ? `Show more, ${rest} left` : `Show all ${work.found[kind]}`}</button>`}
  </section>`;
}

/** The buttons for the chosen items of a kind.
 *
 * @param {{kind: Kind}} props
 */
function WithChosen({ kind }) {
  const some = chosen.value.filter((each) => each.kind === kind).map(({ item }) => item);
  if (some.length === 0) return null;
  const [verb, noun] = [verbOf(kind), nounOf(kind)];
  const compared = `Compare ${count(some.length, noun)}`;
  const isComparable = kind === "runs" && some.length > 1 && some.length <= MOST_COMPARED;
  return html`
    ${isComparable && html`<a class="button primary" data-role="compare" href=${linkToReferences(some.map(({ id }) => id))}>${compared}</a>`}
    ${kind === "runs" && !isComparable && html`<span class="hint">Choose two to four to compare them</span>`}
    <button type="button" class="danger" onClick=${() => remove(kind, some, () => removed(some))}>${verb} ${count(some.length, noun)}</button>
  `;
}

/** @param {readonly Item[]} items Items to choose in addition. */
function without(items) {
  return chosen.value.filter(({ item: { id } }) => items.every((item) => item.id !== id));
}

/** @param {readonly Item[]} items Items that were deleted or renamed. */
function removed(items) {
  chosen.value = without(items);
  return load();
}

/**
 * @param {readonly Kind[]} kinds
 * @param {WorkPublic["found"]} found
 */
function sum(kinds, found) {
  return kinds.reduce((total, kind) => total + found[kind], 0);
}

addEventListener("popstate", () => {
  wish.value = parseQuery(new URLSearchParams(location.search));
  load();
});
// A page from the browser's cache shows an old list; load it again.
addEventListener("pageshow", (event) => event.persisted && load());
showPage("work", "work", Work);
