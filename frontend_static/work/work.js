/** My work: running sessions, saved runs, comparisons, sweeps and uploads, found by words; the address says what is looked for. */

import { START } from "../shared/address.js";
import { api, messageOf } from "../shared/api.js";
import { linkToReferences } from "../shared/comparison_link.js";
import { count } from "../shared/format.js";
import { Failed, showPage } from "../shared/page.js";
import { later } from "../shared/timing.js";
import { h, html, signal, useEffect, useRef } from "../vendor/preact.js";
import { REMOVALS, Row, itemsOf, remove } from "./rows.js";

/** @import { WorkPublic } from "../shared/messages.js" */
/** @import { Item, Kind } from "./rows.js" */
/** @typedef {{words: string, show: Kind|null, limit: number}} Query The words to find, the one kind to list or null for all, and how many of each. */

const TYPING_MS = 250;
const MOST_COMPARED = 4;
/** So many of each kind where all are listed, and so many more at a time where one kind is. */
const FEW = 6;
const MANY = 50;
const PLACEHOLDER = "Title, experiment, tracker, date or outcome";
/** Dates are looked for as they are shown. */
const ZONE = Intl.DateTimeFormat().resolvedOptions().timeZone;

/** @type {Record<Kind, {title: string, empty: string, way: [words: string, href: string]}>} What to say and do where there is nothing. */
const WORDS = {
  sessions: {
    title: "Running sessions",
    empty: "No session is running. Start one with an experiment, and it is listed here until you end it.",
    way: ["Choose an experiment", START],
  },
  runs: {
    title: "Saved runs",
    empty: "No runs are saved yet. Save one on a session's page, and it is listed here.",
    way: ["Choose an experiment", START],
  },
  comparisons: {
    title: "Comparisons",
    empty: "No comparison is saved yet. Compare runs, and save what you see on that page.",
    way: ["Choose an experiment", START],
  },
  sweeps: {
    title: "Sweeps",
    empty: "A sweep runs an experiment over many conditions and draws a map of where each tracker succeeds. None has been started yet.",
    way: ["New sweep", "sweep/new"],
  },
  uploads: {
    title: "Uploads",
    empty: "No recording has been uploaded yet. Drop a video on the start page to track something in it.",
    way: ["Upload a video", START],
  },
};

const KINDS = /** @type {Kind[]} */ (Object.keys(WORDS));

/** The newest answer; or a sentence on why there is none; or nothing yet. */
const answered = signal(/** @type {WorkPublic|string|null} */ (null));
const wish = signal(parseQuery(new URLSearchParams(location.search)));
/** The words as they stand in the field; they are looked for a moment later. */
const typed = signal(wish.value.words);
/** What is chosen, in that order, to be compared, ended or deleted at once; also what another search found. */
const chosen = signal(/** @type {readonly {kind: Kind, item: Item}[]} */ ([]));
let asked = new AbortController();
let waiting = () => {};

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
 * @returns {string} A page's address that says the same.
 */
function addressOf({ words, show }) {
  const address = new URLSearchParams();
  if (show !== null) address.set("show", show);
  if (words.trim() !== "") address.set("q", words.trim());
  return address.size > 0 ? `work?${address}` : "work";
}

/** @param {Partial<Query>} change */
function look(change) {
  waiting();
  const before = addressOf(wish.value);
  const isOtherKind = change.show !== undefined && change.show !== wish.value.show;
  const next = { ...wish.value, words: typed.value, ...change };
  if (isOtherKind) next.limit = next.show === null ? FEW : MANY;
  wish.value = next;
  // Another kind is a step that one may go back; each letter typed is none.
  if (isOtherKind) history.pushState(null, "", addressOf(next));
  else if (addressOf(next) !== before) history.replaceState(null, "", addressOf(next));
  load();
}

/** Ask for what is wished; of several questions only the newest is answered. */
async function load() {
  asked.abort();
  const now = (asked = new AbortController());
  try {
    const { words, show, limit } = wish.value;
    const work = await api.work({ q: words, limit, zone: ZONE, ...(show !== null && { show }) }, now.signal);
    if (!now.signal.aborted) answered.value = work;
  } catch (error) {
    if (!now.signal.aborted) answered.value = messageOf(error);
  }
}

/** All of the page. */
function Work() {
  const field = useRef(/** @type {HTMLInputElement|null} */ (null));
  useEffect(() => void load().then(() => document.querySelector(":target")?.scrollIntoView({ block: "center" })), []);
  const work = answered.value;
  const found = work !== null && typeof work === "object" ? work.found : null;
  const type = (/** @type {Event & {currentTarget: HTMLInputElement}} */ { currentTarget: { value } }) => {
    typed.value = value;
    waiting();
    waiting = later(() => look({}), TYPING_MS);
  };
  const clear = () => {
    field.current?.focus();
    typed.value = "";
    look({});
  };
  const submit = (/** @type {Event} */ event) => {
    event.preventDefault();
    look({});
  };
  return html`
    <form class="search" role="search" onSubmit=${submit}>
      <label>
        Search my work
        <input ref=${field} type="search" value=${typed.value} maxlength="200" placeholder=${PLACEHOLDER} onInput=${type} />
      </label>
      <div class="kinds" role="group" aria-label="Show">
        ${h(Chip, { kind: null, title: "All", amount: found && sum(KINDS, found) })}
        ${KINDS.map((kind) => h(Chip, { kind, title: WORDS[kind].title, amount: found?.[kind] ?? null }))}
      </div>
    </form>
    ${found === null ? h(Without, { why: /** @type {string|null} */ (work) }) : h(Found, { work: /** @type {WorkPublic} */ (work), clear })}
  `;
}

/** @param {{kind: Kind|null, title: string, amount: number|null}} props */
function Chip({ kind, title, amount }) {
  return html`<button type="button" aria-pressed=${String(kind === wish.value.show)} onClick=${() => look({ show: kind })}>
    ${title}<output>${amount}</output>
  </button>`;
}

/** @param {{why: string|null}} props Why there is nothing to show. */
function Without({ why }) {
  if (why !== null) return h(Failed, { title: "Your work could not be listed", message: why, again: load });
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
      ${elsewhere > 0 && html`<button type="button" onClick=${() => look({ show: null })}>Show ${count(elsewhere, "result")} of other kinds</button>`}
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
  const { title, empty, way: [words, href] } = WORDS[kind];
  const items = itemsOf(work, kind);
  const rest = work.found[kind] - items.length;
  const isAlone = wish.value.show === kind;
  const more = () => look(isAlone ? { limit: wish.value.limit + MANY } : { show: kind });
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

/**
 * What can be done with all that is chosen of a kind.
 *
 * @param {{kind: Kind}} props
 */
function WithChosen({ kind }) {
  const some = chosen.value.filter((each) => each.kind === kind).map(({ item }) => item);
  if (some.length === 0) return null;
  const { verb, noun } = REMOVALS[kind];
  const compared = `Compare ${count(some.length, noun)}`;
  const isComparable = kind === "runs" && some.length > 1 && some.length <= MOST_COMPARED;
  return html`
    ${isComparable && html`<a class="button primary" data-role="compare" href=${linkToReferences(some.map(({ id }) => id))}>${compared}</a>`}
    ${kind === "runs" && !isComparable && html`<span class="hint">Choose two to four to compare them</span>`}
    <button type="button" class="danger" onClick=${() => remove(kind, some, () => removed(some))}>${verb} ${count(some.length, noun)}</button>
  `;
}

/** @param {readonly Item[]} items What is chosen besides these. */
function without(items) {
  return chosen.value.filter(({ item: { id } }) => items.every((item) => item.id !== id));
}

/** @param {readonly Item[]} items These are gone, or have another name. */
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
  typed.value = wish.value.words;
  load();
});
// A page that comes back from the browser's cache shows what was; ask again.
addEventListener("pageshow", (event) => event.persisted && load());
showPage("work", "work", Work);
