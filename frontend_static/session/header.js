/** The line above a session: what runs, its presets, and a menu with everything that can be done with the run. */

import { FollowChip } from "../lecturer/class_control.js";
import { request } from "../shared/api.js";
import { askName } from "../shared/dialog.js";
import { attempt, Icon, Popover } from "../shared/dom.js";
import { END_FORK, endFork, PLACES } from "../shared/page.js";
import { PresentationButton } from "../shared/presentation.js";
import { newSweep } from "../shared/share_link.js";
import { GLOSSARY } from "../shared/terms.js";
import { changeTheme, themeWords } from "../shared/theme.js";
import { Brand, isFollower, isParticipant } from "../shared/visitor.js";
import { h, html } from "../vendor/preact.js";
import { headingOf } from "./steering.js";

/** @import { ClassControl } from "../lecturer/class_control.js" */
/** @import { IconName } from "../shared/dom.js" */
/** @import { ExperimentDetail, Preset, SessionPublic } from "../shared/messages.js" */
/** @import { Signal } from "../vendor/preact.js" */
/** @import { Mounted } from "./mount.js" */

/**
 * What the header has to do with.
 *
 * @typedef {object} Page
 * @property {Mounted} view
 * @property {Signal<ExperimentDetail|null>} experiment Null as long as it is not known.
 * @property {ClassControl} control
 * @property {Record<"compare"|"help"|"palette", () => void>} actions
 * @property {{isOffered: Signal<boolean>, toggle: () => void}} editor Of a filter of one's own.
 * @property {(preset: Preset) => void} openPreset
 */

/**
 * Something that can be done, or a page to go to.
 *
 * @typedef {object} Entry
 * @property {string} words
 * @property {string} [tool] Its name for tests and styles.
 * @property {IconName} [icon]
 * @property {string} [keys]
 * @property {string} [title]
 * @property {string} [href]
 * @property {() => unknown} [run]
 * @property {boolean} [needsRun] Whether it needs a session that listens.
 */

/** @param {{page: Page}} props */
export function Header({ page }) {
  const { view, experiment, control, actions } = page;
  const { session } = view.store;
  const presets = experiment.value?.presets ?? [];
  if (session !== null) document.title = `${headingOf(session)} · pftrack`;
  const compare = html`<button type="button" data-tool="compare" title="Compare this run with others (C)" disabled=${!view.able} onClick=${actions.compare}>
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
  const title = "Presets: what to look at in this experiment (P)";
  const content = html`<ul class="menu-list preset-list">${list}</ul>`;
  return h(Popover, { icon: "presets", label: "Presets", title, words: html`<span class="wide-only">Presets</span>`, content });
}

/** @param {{page: Page}} props */
function Menu({ page }) {
  const groups = menuOf(page).map(([title, entries]) => html`<section>
    <h2>${title}</h2>
    <ul class="menu-list">${entries.map((entry) => h(Line, { key: entry.words, entry, isOff: Boolean(entry.needsRun) && !page.view.able }))}</ul>
  </section>`);
  const find = html`<button type="button" class="grow" onClick=${page.actions.palette}>Find anything<kbd>Ctrl K</kbd></button>`;
  const content = html`<nav class="command-list" aria-label="Menu">${find}${groups}</nav>`;
  return h(Popover, { icon: "more", label: "Menu", title: "All that can be done here", content });
}

/** @param {{entry: Entry, isOff: boolean}} props */
function Line({ entry: { words, tool, icon, keys, title, href, run }, isOff }) {
  const content = html`${icon && h(Icon, { name: icon })}<span>${words}</span>${keys && html`<kbd>${keys}</kbd>`}`;
  if (href !== undefined) return html`<li><a class="button quiet grow" href=${href} title=${title} data-tool=${tool}>${content}</a></li>`;
  const press = (/** @type {Event & {currentTarget: HTMLElement}} */ { currentTarget }) => {
    /** @type {HTMLElement|null} */ (currentTarget.closest("[popover]"))?.hidePopover();
    run?.();
  };
  return html`<li><button type="button" class="quiet grow" title=${title} data-tool=${tool} disabled=${isOff} onClick=${press}>${content}</button></li>`;
}

/**
 * Everything that can be done here, in groups. A participant of a class can keep nothing.
 *
 * @param {Page} page
 * @returns {[title: string, entries: Entry[]][]}
 */
export function menuOf({ view, experiment, actions, editor }) {
  const { session } = view.store;
  const { actions: keys, commands } = view;
  const detail = experiment.value;
  const about = async () => detail && (await import("./dialogs.js")).aboutDialog(detail);
  /** @type {Entry[]} */
  const run = [
    { words: "Branch from this frame…", tool: "branch", icon: "branch", keys: "N", needsRun: true, run: keys.branch },
    { words: "Look into the frame", tool: "inspect", icon: "inspect", keys: "I", title: "Likelihood, particles, ancestors", needsRun: true, run: keys.inspect },
  ];
  if (session !== null && session.watch !== "") {
    const turn = () => (view.hasNote.value = !view.hasNote.peek());
    run.push({ words: "What to look at", tool: "watch", title: "Show the note below the picture, or put it away", run: turn });
  }
  if (isFollower) run.push({ words: "End", tool: "close", icon: "close", title: END_FORK, run: endFork });
  if (!isParticipant) {
    const share = async () => (await import("./dialogs.js")).shareDialog(view.store.known);
    const files = async () => (await import("./dialogs.js")).filesDialog(view);
    run.push(
      { words: "Save", tool: "save", icon: "save", needsRun: true, run: () => commands.save() },
      { words: "Share…", tool: "share", icon: "share", needsRun: true, run: share },
      { words: "Export and import…", tool: "files", icon: "files", needsRun: true, run: files },
    );
    if (session !== null) run.push({ ...sweepOf(session), tool: "sweep", icon: "sweep" });
    if (editor.isOffered.value) run.push({ words: "Code", tool: "code", icon: "code", title: "Write your filter beside the scene", run: editor.toggle });
    run.push({ words: "Rename…", tool: "rename", icon: "rename", needsRun: true, run: () => rename(view) });
  }
  /** @type {Entry[]} */
  const page = [
    { words: "About this experiment", tool: "about", icon: "about", title: "What it is about, and how to cite it", run: about },
    { words: `Colours: ${themeWords()}`, tool: "theme", icon: "auto", run: changeTheme },
    { words: "Keys", tool: "help", icon: "menu", keys: "?", run: actions.help },
  ];
  if (isParticipant) return [["This run", run], ["This page", page]];
  const places = PLACES.map(({ title, href }) => ({ words: title, href }));
  return [["This run", run], ["This page", page], ["pftrack", [...places, { words: "Glossary", href: GLOSSARY }]]];
}

/** @param {Mounted} view */
async function rename({ store: { known } }) {
  const name = await askName("Rename this session", known.name);
  if (name !== null) await attempt(() => request("PATCH sessions/{session}", { session: known.id, body: { name } }));
}

/**
 * The sweep that a run comes from, or a new one over its scene or recording, with the values with which the run began, over what was moved
 * last.
 *
 * @param {SessionPublic} session
 * @returns {Entry}
 */
function sweepOf({ sweep, recipe, tracker, upload }) {
  if (sweep) return { words: "Sweep", title: "The sweep that this run comes from", href: `sweep/${encodeURIComponent(sweep)}` };
  const [first] = recipe.timeline ?? [];
  const last = recipe.timeline?.findLast(({ frame, values }) => frame > 0 && !("move" in values));
  const plan = {
    experiment: recipe.experiment,
    upload,
    footage: recipe.footage,
    axes: Object.keys(last?.values ?? {}).slice(-1).map((name) => ({ name })),
    trackers: [recipe.tracker ?? tracker],
    parameters: first?.frame === 0 ? first.values : {},
  };
  return { words: "Sweep", title: "Repeat this run with other seeds, parameters and trackers", href: newSweep(plan) };
}
