/** My work: running sessions, saved runs, comparisons, sweeps and uploads, found by words; the address says what is looked for. */

import { START } from "../shared/address.js";
import { api, messageOf } from "../shared/api.js";
import { fill, h, part, setText } from "../shared/dom.js";
import { count } from "../shared/format.js";
import { linkToReferences } from "../shared/comparison_link.js";
import { navigation } from "../shared/navigation.js";
import { notice } from "../shared/notice.js";
import { themeButton } from "../shared/theme.js";
import { later } from "../shared/timing.js";
import { comparisonRow, runRow, sessionRow, sweepRow, uploadRow } from "./rows.js";
import { FEW, KINDS, MANY, addressOf, parseQuery } from "./query.js";

/** @import { WorkPublic } from "../shared/messages.js" */
/** @import { Kind, Query } from "./query.js" */

const SKELETON_AFTER_MS = 200;
const TYPING_MS = 250;
const MOST_COMPARED = 4;
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

/**
 * Saved runs that are chosen to be compared, in the order in which they were.
 *
 * @type {Set<string>}
 */
const chosen = new Set();
const comparing = h("a", { class: "button primary", data: { role: "compare" } });

let wish = parseQuery(new URLSearchParams(location.search));
let asked = new AbortController();
let waiting = () => {};

const field = h("input", { type: "search", value: wish.words, maxlength: 200, placeholder: "Title, experiment, tracker, date or outcome" });
const chips = [chip(null, "All"), ...KINDS.map((kind) => chip(kind, WORDS[kind].title))];

navigation("work");
part("tools").append(themeButton());
fill(
  part("search"),
  h("label", {}, "Search my work", field),
  h("div", { class: "kinds", role: "group", "aria-label": "Show" }, chips.map(({ element }) => element)),
);
part("search").addEventListener("submit", (event) => {
  event.preventDefault();
  look({ words: field.value });
});
field.addEventListener("input", () => {
  waiting();
  waiting = later(() => look({ words: field.value }), TYPING_MS);
});
addEventListener("popstate", () => {
  wish = parseQuery(new URLSearchParams(location.search));
  field.value = wish.words;
  load();
});
// A page that comes back from the browser's cache shows what was; ask again.
addEventListener("pageshow", (event) => event.persisted && load());
load().then(() => document.querySelector(":target")?.scrollIntoView({ block: "center" }));

/** @param {Partial<Query>} change */
function look(change) {
  waiting();
  const before = addressOf(wish);
  const isOtherKind = change.show !== undefined && change.show !== wish.show;
  wish = { ...wish, ...change };
  if (isOtherKind) wish.limit = wish.show === null ? FEW : MANY;
  // Another kind is a step that one may go back; each letter typed is none.
  if (isOtherKind) history.pushState(null, "", addressOf(wish));
  else if (addressOf(wish) !== before) history.replaceState(null, "", addressOf(wish));
  load();
}

/** Ask for what is wished; of several questions only the newest is answered. */
async function load() {
  asked.abort();
  const now = (asked = new AbortController());
  const there = later(() => part("lists").childElementCount === 0 && fill(part("lists"), bones()), SKELETON_AFTER_MS, now.signal);
  try {
    const { words, show, limit } = wish;
    const work = await api.work({ q: words, limit, zone: ZONE, ...(show !== null && { show }) }, now.signal);
    if (!now.signal.aborted) draw(work);
  } catch (error) {
    if (now.signal.aborted) return;
    fill(part("lists"), notice("Your work could not be listed", messageOf(error), { label: "Try again", run: load }, { inline: true }));
  } finally {
    there();
  }
}

/** @param {WorkPublic} work */
function draw(work) {
  for (const { kind, element, amount } of chips) {
    element.setAttribute("aria-pressed", String(kind === wish.show));
    setText(amount, String(kind === null ? KINDS.reduce((sum, each) => sum + work.found[each], 0) : work.found[kind]));
  }
  const isSearch = wish.words.trim() !== "";
  const shown = KINDS.filter((kind) => (wish.show === null ? !isSearch || work.found[kind] > 0 : kind === wish.show));
  const found = KINDS.reduce((sum, kind) => sum + (wish.show === null || wish.show === kind ? work.found[kind] : 0), 0);
  setText(part("said"), isSearch ? `${count(found, "result")} found` : "");
  fill(part("lists"), isSearch && found === 0 ? nothing(work) : shown.map((kind) => section(kind, work)));
}

/**
 * @param {Kind} kind
 * @param {WorkPublic} work
 */
function section(kind, work) {
  const { title, empty, way: [words, href] } = WORDS[kind];
  const rows = rowsOf(kind, work);
  const rest = work.found[kind] - rows.length;
  const isAlone = wish.show === kind;
  const more = () => look(isAlone ? { limit: wish.limit + MANY } : { show: kind });
  return h(
    "section",
    { "aria-label": title, data: { part: kind } },
    h("header", {}, h("h2", {}, title), kind === "sweeps" && h("a", { class: "button", href }, words), kind === "runs" && comparing),
    rows.length > 0 ? h("ul", { class: "rows" }, rows) : h("p", { class: "empty" }, empty, kind !== "sweeps" && h("a", { class: "button", href }, words)),
    rest > 0 && h("button", { type: "button", class: "quiet", on: { click: more } }, isAlone ? `Show more, ${rest} left` : `Show all ${work.found[kind]}`),
  );
}

/**
 * @param {Kind} kind
 * @param {WorkPublic} work
 */
function rowsOf(kind, work) {
  switch (kind) {
    case "sessions":
      return work.sessions.map((session) => sessionRow(session, load));
    case "runs":
      return runRows(work);
    case "comparisons":
      return work.comparisons.map((comparison) => comparisonRow(comparison, load));
    case "sweeps":
      return work.sweeps.map((sweep) => sweepRow(sweep, load));
    default:
      return work.uploads.map((upload) => uploadRow(upload, load));
  }
}

/**
 * Saved runs, with a box each to choose them for a comparison.
 *
 * @param {WorkPublic} work
 */
function runRows(work) {
  const choice = {
    has: (/** @type {string} */ run) => chosen.has(run),
    isFull: chosen.size >= MOST_COMPARED,
    toggle: (/** @type {string} */ run) => {
      if (!chosen.delete(run)) chosen.add(run);
      draw(work);
      /** @type {HTMLElement|null} */ (document.querySelector(`[data-run="${run}"] input`))?.focus();
    },
  };
  comparing.hidden = chosen.size < 2;
  comparing.href = linkToReferences([...chosen]);
  setText(comparing, `Compare ${count(chosen.size, "run")}`);
  return work.runs.map((run) => runRow(run, load, choice));
}

/**
 * What to do where nothing has all the words.
 *
 * @param {WorkPublic} work
 */
function nothing(work) {
  const elsewhere = KINDS.reduce((sum, kind) => sum + work.found[kind], 0);
  const all = () => look({ show: null });
  const clear = () => {
    field.value = "";
    field.focus();
    look({ words: "" });
  };
  return h(
    "section",
    {},
    h(
      "p",
      { class: "empty" },
      `Nothing matches all of these words: ${wish.words.trim()}. Try fewer words.`,
      elsewhere > 0 && h("button", { type: "button", on: { click: all } }, `Show ${count(elsewhere, "result")} of other kinds`),
      h("button", { type: "button", on: { click: clear } }, "Clear the search"),
    ),
  );
}

/**
 * @param {Kind|null} kind
 * @param {string} title
 */
function chip(kind, title) {
  const amount = h("output", {});
  const press = () => look({ show: kind, words: field.value });
  const element = h("button", { type: "button", "aria-pressed": String(kind === wish.show), on: { click: press } }, title, amount);
  return { kind, element, amount };
}

function bones() {
  return [0, 1, 2].map(() => h("section", { "aria-hidden": "true" }, h("div", { class: "bone short shimmer" }), h("div", { class: "bone shimmer" })));
}
