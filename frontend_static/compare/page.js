/** The page of a comparison: the runs of its address next to each other, and a link with all their recipes. */

import { ClassControl, FollowChip } from "../lecturer/class_control.js";
import { HELP } from "../session/keys.js";
import { graphics, NO_GRAPHICS, VIEWS } from "../session/scene.js";
import { messageOf, request } from "../shared/api.js";
import { linkTo, savedOf, wantedOf } from "../shared/comparison.js";
import { askName, openKeys } from "../shared/dialog.js";
import { attempt, Icon, IconButton, Notice, part, Popover, Segments, toast } from "../shared/dom.js";
import { Exports, openCode } from "../shared/exports.js";
import { Loaded, showPage } from "../shared/page.js";
import { present, PresentationButton, PrintButton } from "../shared/presentation.js";
import { computed, effect, h, html, render, signal } from "../vendor/preact.js";
import { compare, Comparison } from "./compare.js";

/** @import { ViewKind } from "../session/scene.js" */
/** @import { Arrangement } from "../shared/comparison.js" */
/** @import { ComparedRun } from "../shared/messages.js" */
/** @import { RunComparison } from "./compare.js" */

const WORK = { label: "Choose saved runs", href: "work?show=runs" };
const EMPTY = "Compare a session with its branches or with other trackers (key C on its page), two saved runs (My work), or two trackers on a row of a sweep.";
const RECORDING = "The link does not contain recordings: on another server, upload the recording first.";
const LONGEST_TITLE = 200;
const FILES = { icon: /** @type {const} */ ("files"), label: "Files", title: "Export this comparison", class: "tool", "data-tool": "files" };
const IN_STEP = ["space", "← →", "shift ← →", "home end", "L", "E", "[ ]", "+ - 0", "F", "pageup pagedown", "?"];
/** The keys of a session that move all runs, and one further key. */
const KEYS = [...HELP.filter(({ keys }) => IN_STEP.includes(keys)), { keys: "D", what: "Go to the first frame in which two runs differ" }];
const ARRANGEMENTS = [
  { value: "side", words: "Side by side", hint: "Each run has its own picture" },
  { value: "over", words: "Over each other", hint: "All runs on the picture of the first, each in its colour" },
];

const compared = signal(/** @type {RunComparison|null} */ (null));
/** The title given by a person; empty if the names of the runs are the title. */
const givenTitle = signal("");
/** The saved comparison on the page, with its content as text. */
const saved = signal(/** @type {{id: string, content: string|null}|null} */ (null));
/** The reason for waiting, one sentence. */
const waiting = signal("");
const title = computed(() => givenTitle.value || (compared.value?.outline.runs ?? []).map(({ name }) => name).join(" · "));
/** The content of a saved comparison, except for the shown frame. */
const content = computed(() => compared.value && JSON.stringify([compared.value.runs, compared.value.arrangement.value]));
const isSaved = computed(() => saved.value !== null && saved.value.content === content.value);
const control = new ClassControl(() => {
  const shown = compared.value;
  if (shown === null || shown.sessions.value.length === 0) return null;
  return { title: title.value, sessions: shown.sessions.value, lesson: null, arrangement: { comparison: shown.told } };
});

async function load() {
  try {
    const id = savedOf(location);
    const wanted = id === null ? wantedOf(location) : await request("GET comparisons/saved/{saved}", { saved: id });
    if (wanted === null) return h(Notice, { title: "Nothing to compare yet", message: EMPTY, action: WORK, inline: false });
    const options = { actions: { help, present: () => present() }, onFewer: showFewer };
    const shown = await compare(wanted, (sentence) => (waiting.value = sentence), options);
    givenTitle.value = wanted.title ?? "";
    compared.value = shown;
    saved.value = id === null ? null : { id, content: content.value };
    shown.begun.then(() => control.find(), () => {});
    return h(Comparison, { compared: shown });
  } catch (error) {
    return h(Notice, { title: "These runs cannot be compared", message: messageOf(error), action: WORK, inline: false });
  }
}

/** @param {ComparedRun[]} runs The remaining runs; their address opens a new comparison. */
function showFewer(runs) {
  location.assign(linkTo({ runs, position: compared.value?.position }));
}

function Wait() {
  return waiting.value !== "" && html`<p class="note compiling" role="status">${waiting.value}. The comparison begins by itself.</p>`;
}

/** Save the present view as a new comparison. */
async function saveIt() {
  const shown = compared.value;
  const name = shown && (await askName("Save this comparison", title.value.slice(0, LONGEST_TITLE), "Save"));
  if (!shown || name === null) return;
  const { runs, position = 0, arrangement = "side" } = shown.wanted;
  const recipes = runs.flatMap(({ recipe }) => (recipe ? [{ recipe }] : []));
  await attempt(async () => {
    const kept = await request("POST comparisons/saved", { body: { title: name, runs: recipes, position, arrangement } });
    saved.value = { id: kept.id, content: content.value };
    givenTitle.value = name;
    toast("Saved; My work lists it", { action: { label: "My work", href: "work?show=comparisons" } });
  });
}

/** Rename the comparison here and on the server. */
async function renameIt() {
  const name = await askName("Rename this comparison", title.value);
  if (name === null) return;
  await attempt(async () => {
    if (saved.value !== null) await request("PATCH comparisons/saved/{saved}", { saved: saved.value.id, body: { title: name } });
    givenTitle.value = name;
  });
}

function share() {
  if (compared.value === null) return;
  const { wanted } = compared.value;
  const words = [
    `The link holds the settings of all runs, and frame ${wanted.position}. ` +
      "Wherever it is opened, the runs have the same numbers and differ from the same frame on.",
    wanted.runs.some(({ recipe }) => recipe?.footage) ? RECORDING : "",
  ];
  openCode("Share this comparison", words, () => request("POST source-code", { body: { runs: wanted.runs } }), linkTo({ ...wanted, title: givenTitle.value }));
}

const help = () => openKeys(KEYS.map(({ keys, what }) => [keys, what]));

/** The tools at the right of the header. */
function Tools() {
  const shown = compared.value;
  const arrange = (/** @type {string} */ kind) => shown?.arrange(/** @type {Arrangement} */ (kind));
  const view = (/** @type {string} */ kind) => {
    if (kind === "scene" && graphics() === "none") toast(NO_GRAPHICS, { kind: "error" });
    else shown?.show(/** @type {ViewKind} */ (kind));
  };
  return html`
    ${h(Segments, { label: "Arrangement", options: ARRANGEMENTS, value: shown?.arrangement.value ?? "side", choose: arrange })}
    ${h(Segments, { label: "View", options: VIEWS, value: shown?.view.value ?? "flat", choose: view })}
    ${h(FollowChip, { control })}
    ${h(Tool, { name: "save", text: "Save", hint: "Save this comparison in My work", isOff: isSaved.value, run: saveIt })}
    ${h(Popover, { ...FILES, words: html`<span class="wide-only">Files</span>`, content: shown && h(Files, { shown }), disabled: shown === null })}
    ${h(Tool, { name: "share", text: "Share", hint: "Share a link to this comparison", run: share })}
    ${h(PrintButton, {})}${h(PresentationButton, { hears: false })}
    <button type="button" class="quiet icon-only" title="Keys (?)" aria-label="Keys" onClick=${help}>?</button>
  `;
}

/** @param {{shown: RunComparison}} props */
function Files({ shown }) {
  const body = { runs: shown.runs, title: title.value.slice(0, LONGEST_TITLE) };
  const begin = (/** @type {string} */ name) => request("POST comparisons/exports/{export}", { export: name, body });
  return html`<section><h2>Export</h2>${h(Exports, { offered: shown.outline.exports ?? [], begin })}</section>`;
}

/** @param {{name: import("../shared/dom.js").IconName, text: string, hint: string, isOff?: boolean, run: () => void}} props */
function Tool({ name, text, hint, isOff = false, run }) {
  return html`<button type="button" class="tool" title=${hint} disabled=${isOff || compared.value === null} data-tool=${name} onClick=${run}>
    ${h(Icon, { name })}<span class="wide-only">${text}</span>
  </button>`;
}

/** The title of the comparison. */
function Heading() {
  return html`<h1 data-part="title">${title.value ? `Compare · ${title.value}` : "Compare"}</h1>
    ${compared.value && h(IconButton, { name: "rename", title: "Rename this comparison", run: renameIt })}`;
}

effect(() => {
  const shown = compared.value;
  if (shown === null) return;
  document.title = `${title.value} · Compare · pftrack`;
  // The address holds the recipes of the runs once they are known, so that it can be stored, sent and reloaded.
  const { runs, arrangement } = shown;
  history.replaceState(null, "", linkTo({ runs, arrangement: arrangement.value, title: givenTitle.value }));
});
// The sessions ended with the page; a page from the browser's cache starts again.
addEventListener("pageshow", (event) => event.persisted && location.reload());
addEventListener("hashchange", () => location.reload());
render(h(Heading, {}), part("heading"));
const bones = html`<div class="comparison-wait">${h(Wait, {})}<div class="shimmer"></div></div>`;
showPage("comparison", null, () => h(Loaded, { load, failed: "", bones }), h(Tools, {}));
