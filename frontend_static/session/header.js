/** The line above a session: its title, its presets, and a menu with all commands of the run. */

import { FollowChip } from "../lecturer/class_control.js";
import { addressOf, request } from "../shared/api.js";
import { askName } from "../shared/dialog.js";
import { attempt, Icon, Popover, toast } from "../shared/dom.js";
import { END_FORK, endFork, PLACES } from "../shared/page.js";
import { PresentationButton } from "../shared/presentation.js";
import { newSweep } from "../shared/share_link.js";
import { GLOSSARY } from "../shared/terms.js";
import { changeTheme, themeWords } from "../shared/theme.js";
import { Brand, isFollower, isParticipant } from "../shared/visitor.js";
import { h, html } from "../vendor/preact.js";
import { headingOf, repeated } from "./steering.js";

/** @import { ClassControl } from "../lecturer/class_control.js" */
/** @import { IconName } from "../shared/dom.js" */
/** @import { ExperimentDetail, Preset, SessionPublic } from "../shared/messages.js" */
/** @import { Signal } from "../vendor/preact.js" */
/** @import { Mounted } from "./mount.js" */

/** The parts of the page that the header uses.
 *
 * @typedef {object} Page
 * @property {Mounted} view
 * @property {Signal<ExperimentDetail|null>} experiment Null while it is not known.
 * @property {ClassControl} control
 * @property {Record<"compare"|"help"|"palette", () => void>} actions
 * @property {{isOffered: Signal<boolean>, toggle: () => void}} editor The editor of a person's own filter.
 * @property {(preset: Preset) => void} openPreset
 */

/** A command, or a page to go to.
 *
 * @typedef {object} Entry
 * @property {string} words
 * @property {string} [tool] Its name for tests and styles.
 * @property {IconName} [icon]
 * @property {string} [keys]
 * @property {string} [hint] Kind of the entry.
 * @property {string} [title]
 * @property {string} [href]
 * @property {() => unknown} [run]
 * @property {boolean} [needsRun] Whether it needs a live session.
 */

/** @param {{page: Page}} props */
export function Header({ page }) {
  const { view, experiment, control, actions } = page;
  const { session, isSteerable } = view.store;
  const presets = experiment.value?.presets ?? [];
  if (session !== null) document.title = `${headingOf(session)} · pftrack`;
  const compare = html`<button type="button" data-tool="compare" title="Compare this run with others (C)" disabled=${!isSteerable} onClick=${actions.compare}>
    ${h(Icon, { name: "compare" })}<span class="wide-only">Compare</span>
  </button>`;
  return html`
    ${h(Brand, {})}
    <h1>${session && headingOf(session)}</h1>
    <span class="spring"></span>
    ${!isParticipant && presets.length > 0 && h(Presets, { presets, choose: page.openPreset })}
    ${!isParticipant && compare}
    ${!isFollower && h(FollowChip, { control })}
    ${h(PresentationButton, { hears: false })}
    ${h(Menu, { page })}
  `;
}

/** @param {{presets: Preset[], choose: (preset: Preset) => void}} props */
function Presets({ presets, choose }) {
  const list = presets.map((preset) => html`<li>
    <button type="button" class="quiet grow" data-preset=${preset.name} onClick=${() => choose(preset)}>
      <span>${preset.title}</span><span class="hint">${preset.watch}</span>
    </button>
  </li>`);
  const title = "Presets of this experiment (P)";
  const content = html`<ul class="menu-list preset-list">${list}</ul>`;
  return h(Popover, { icon: "presets", label: "Presets", title, words: html`<span class="wide-only">Presets</span>`, content });
}

/** @param {{page: Page}} props */
function Menu({ page }) {
  const groups = menuOf(page).map(([title, entries]) => html`<section>
    <h2>${title}</h2>
    <ul class="menu-list">${entries.map((entry) => h(Line, { key: entry.words, entry, isOff: Boolean(entry.needsRun) && !page.view.store.isSteerable }))}</ul>
  </section>`);
  const find = html`<button type="button" class="grow" onClick=${page.actions.palette}>Find anything<kbd>Ctrl K</kbd></button>`;
  const content = html`<nav class="command-list" aria-label="Menu">${find}${groups}</nav>`;
  return h(Popover, { icon: "more", label: "Menu", title: "All commands of this page", content });
}

/** @param {{entry: Entry, isOff?: boolean}} props */
export function Line({ entry: { words, tool, icon, keys, hint, title, href, run }, isOff = false }) {
  const more = html`${keys && html`<kbd>${keys}</kbd>`}${hint && html`<span class="hint">${hint}</span>`}`;
  const content = html`${icon && h(Icon, { name: icon })}<span>${words}</span>${more}`;
  if (href !== undefined) return html`<li><a class="button quiet grow" href=${href} title=${title} data-tool=${tool}>${content}</a></li>`;
  const press = (/** @type {Event & {currentTarget: HTMLElement}} */ { currentTarget }) => {
    /** @type {HTMLElement|null} */ (currentTarget.closest("[popover]"))?.hidePopover();
    run?.();
  };
  return html`<li><button type="button" class="quiet grow" title=${title} data-tool=${tool} disabled=${isOff} onClick=${press}>${content}</button></li>`;
}

/** All commands of the page, in groups. A participant of a class cannot save anything.
 *
 * @param {Page} page
 * @returns {[title: string, entries: Entry[]][]}
 */
export function menuOf({ view, experiment, actions, editor }) {
  const { store: { session }, actions: keys, hasNote } = view;
  const dialogs = () => import("./dialogs.js");
  const about = async () => experiment.value && (await dialogs()).aboutDialog(experiment.value);
  const note = { title: "Show or hide the note below the picture", run: () => (hasNote.value = !hasNote.peek()) };
  const code = { title: "Edit your filter next to the scene", run: editor.toggle };
  const mayKeep = !isParticipant;
  /** @type {(Entry|false)[]} */
  const run = [
    { words: "Branch from this frame…", tool: "branch", icon: "branch", keys: "N", needsRun: true, run: keys.branch },
    { words: "Inspect the frame", tool: "inspect", icon: "inspect", keys: "I", title: "Likelihood, particles, ancestors", needsRun: true, run: keys.inspect },
    Boolean(session?.watch) && { words: "What to look at", tool: "watch", ...note },
    isFollower && { words: "End", tool: "close", icon: "close", title: END_FORK, run: endFork },
    mayKeep && { words: "Save", tool: "save", icon: "save", needsRun: true, run: () => save(view) },
    mayKeep && { words: "Share…", tool: "share", icon: "share", needsRun: true, run: async () => (await dialogs()).shareDialog(view.store.known) },
    mayKeep && { words: "Export and import…", tool: "files", icon: "files", needsRun: true, run: async () => (await dialogs()).filesDialog(view) },
    mayKeep && session !== null && sweepOf(session),
    editor.isOffered.value && { words: "Code", tool: "code", icon: "code", ...code },
    mayKeep && { words: "Rename…", tool: "rename", icon: "rename", needsRun: true, run: () => rename(view) },
  ];
  /** @type {Entry[]} */
  const page = [
    { words: "About this experiment", tool: "about", icon: "about", title: "Description and references", run: about },
    { words: `Colours: ${themeWords()}`, tool: "theme", icon: "auto", run: changeTheme },
    { words: "Keys", tool: "help", icon: "menu", keys: "?", run: actions.help },
  ];
  /** @type {Entry[]} */
  const places = isParticipant ? [] : [...PLACES.map(({ title, href }) => ({ words: title, href })), { words: "Glossary", href: GLOSSARY }];
  const groups = { "This run": run.filter((each) => each !== false), "This page": page, pftrack: places };
  return Object.entries(groups).filter(([, entries]) => entries.length > 0);
}

/** @param {Mounted} view */
async function save({ store: { known } }) {
  const run = await attempt(() => request("POST runs", { body: { session: known.id } }));
  if (run) toast("Saved; My work lists it", { action: { label: "Download", href: addressOf("GET runs/{run}/download", { run: run.id }) } });
}

/** @param {Mounted} view */
async function rename({ store: { known } }) {
  const name = await askName("Rename this session", known.name);
  if (name !== null) await attempt(() => request("PATCH sessions/{session}", { session: known.id, body: { name } }));
}

/** The sweep that a run comes from, or a new one on its scene or recording, with the run's first values, over the parameter changed last.
 *
 * @param {SessionPublic} session
 * @returns {Entry}
 */
function sweepOf(session) {
  const { sweep, recipe } = session;
  const look = /** @type {const} */ ({ words: "Sweep", tool: "sweep", icon: "sweep" });
  if (sweep) return { ...look, title: "The sweep that this run comes from", href: `sweep/${encodeURIComponent(sweep)}` };
  const changed = (recipe.timeline ?? []).flatMap(({ frame, values }) => (frame > 0 ? Object.keys(values) : []));
  const axes = changed.filter((name) => name !== "move").slice(-1).map((name) => ({ name }));
  return { ...look, title: "Repeat this run with other seeds, parameters and trackers", href: newSweep({ ...repeated(session), axes }) };
}
