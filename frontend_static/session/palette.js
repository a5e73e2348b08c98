/** A search over a session's page: commands of the menu, parameters, presets, lessons and saved runs. */

import { request } from "../shared/api.js";
import { openDialog } from "../shared/dialog.js";
import { attempt } from "../shared/dom.js";
import { linkTo, presetRecipe } from "../shared/share_link.js";
import { isParticipant } from "../shared/visitor.js";
import { h, html, useEffect, useSignal } from "../vendor/preact.js";
import { Line, menuOf } from "./header.js";
import { readBy } from "./panel.js";

/** @import { ExperimentPublic, LessonsPublic, Preset } from "../shared/messages.js" */
/** @import { Entry, Page } from "./header.js" */

/** Most matches to show. */
const MOST = 12;

/** @param {Page} page */
export function openPalette(page) {
  openDialog("Find anything", (close) => h(Palette, { page, close }), "wide");
}

/** @param {{page: Page, close: () => void}} props */
function Palette({ page, close }) {
  const words = useSignal("");
  const far = useSignal(/** @type {Entry[]} */ ([]));
  useEffect(() => void distant().then((found) => (far.value = found)), []);
  const find = () => {
    const asked = words.value.toLowerCase().split(/\s+/u).filter(Boolean);
    const fits = (/** @type {Entry} */ entry) => asked.every((word) => `${entry.words} ${entry.hint}`.toLowerCase().includes(word));
    return [...near(page), ...far.value].filter(fits).slice(0, MOST);
  };
  const found = find();
  const press = (/** @type {Entry} */ { href, run }) => {
    close();
    if (href !== undefined) location.assign(href);
    else run?.();
  };
  const type = (/** @type {Event & {currentTarget: HTMLInputElement}} */ { currentTarget }) => (words.value = currentTarget.value);
  const submit = (/** @type {Event} */ event) => {
    event.preventDefault();
    // The list may not be drawn yet for the newest words.
    const [first] = find();
    if (first) press(first);
  };
  return html`<form class="palette" onSubmit=${submit} onKeyDown=${walk}>
    <input type="search" autofocus aria-label="Search" placeholder="Parameter, preset, lesson, run…" value=${words.value} onInput=${type} />
    <ul class="menu-list" aria-label="Found">
      ${found.map((entry) => h(Line, { entry: { words: entry.words, hint: entry.hint, run: () => press(entry) } }))}
    </ul>
    ${found.length === 0 && html`<p class="hint" role="status">No match. Try fewer words.</p>`}
  </form>`;
}

/** Entries of this page.
 *
 * @param {Page} page
 * @returns {Entry[]}
 */
function near(page) {
  const { view, experiment, openPreset } = page;
  const { session, isSteerable } = view.store;
  const menu = menuOf(page).flatMap(([hint, entries]) => entries.filter(({ needsRun }) => isSteerable || !needsRun).map((entry) => ({ ...entry, hint })));
  if (session === null) return menu;
  const turned = readBy(session).map(({ label }) => ({ words: label, hint: "Parameter", run: () => turn(label) }));
  const listed = isParticipant ? [] : (experiment.value?.presets ?? []);
  const presets = listed.map((preset) => ({ words: preset.title, hint: "Preset", run: () => openPreset(preset) }));
  return [...menu, ...turned, ...presets];
}

/** Entries elsewhere on this server: lessons, other experiments' presets, saved runs.
 *
 * @returns {Promise<Entry[]>}
 */
async function distant() {
  if (isParticipant) return [];
  const [course, experiments, work] = await Promise.all([
    /** @type {Promise<LessonsPublic|null>} */ (request("GET lessons").catch(() => null)),
    request("GET experiments").catch(() => []),
    request("GET work", { show: "runs", limit: 100 }).catch(() => null),
  ]);
  const learned = (course?.lessons ?? []).map(({ id, title }) => ({ words: title, hint: "Lesson", href: `learn/${encodeURIComponent(id)}` }));
  const address = (/** @type {ExperimentPublic} */ each, /** @type {Preset} */ preset) => linkTo({ recipe: presetRecipe(each, preset), play: true });
  const begun = experiments.flatMap((each) =>
    each.presets.map((preset) => ({ words: `${each.title} · ${preset.title}`, hint: "Preset", href: address(each, preset) })),
  );
  const saved = (work?.runs ?? []).map(({ id, title }) => ({ words: title, hint: "Saved run", run: () => open(id) }));
  return [...learned, ...begun, ...saved];
}

/** @param {string} run */
async function open(run) {
  const session = await attempt(() => request("POST runs/{run}/open", { run }));
  if (session) location.assign(session.page);
}

/** Go to the control of a parameter and unfold its group; on a narrow page, the panel, too.
 *
 * @param {string} label
 */
function turn(label) {
  const found = [...document.querySelectorAll(".controls .control")].find((each) => each.querySelector("label, span")?.textContent === label);
  for (let at = found?.parentElement; at; at = at.parentElement) if (at.tagName === "DETAILS") at.setAttribute("open", "");
  const field = found?.querySelector("input, select");
  const opener = /** @type {HTMLElement|null} */ (document.querySelector(".controls-opener[aria-expanded=false]"));
  if (opener?.checkVisibility()) opener.click();
  // It gets the focus once the panel is drawn.
  if (field instanceof HTMLElement) requestAnimationFrame(() => field.focus());
}

/** @param {KeyboardEvent & {currentTarget: HTMLElement}} event Arrow keys move through the field and the lines. */
function walk(event) {
  const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
  if (step === undefined) return;
  event.preventDefault();
  const stops = /** @type {HTMLElement[]} */ ([...event.currentTarget.querySelectorAll("input, li button")]);
  const at = stops.indexOf(/** @type {HTMLElement} */ (document.activeElement));
  stops[Math.min(Math.max(0, at + step), stops.length - 1)].focus();
}
