/** Shared parts of all pages: the frame around the content, and loading from the server. */

import { h, html, render, useEffect, useRef, useSignal } from "../vendor/preact.js";
import { here, messageOf, request, START, statusOf } from "./api.js";
import { attempt, build, elementOf, Icon, Notice, part } from "./dom.js";
import "./presentation.js";
import { linkTo, presetRecipe } from "./share_link.js";
import { ThemeButton } from "./theme.js";
import { Brand, isParticipant, remember, remembered } from "./visitor.js";

/** @import { Child, Component } from "../vendor/preact.js" */
/** @import { Action } from "./dom.js" */
/** @import { ExperimentPublic } from "./messages.js" */

// The links to all parts of the site in the header of every page, and a link that skips them.

// Escape ends a presentation on every page of the site.

/** @typedef {"experiments"|"learn"|"failures"|"lectures"|"work"|"help"} Place */

/** @type {readonly {id: Place, title: string, href: string}[]} */
export const PLACES = [
  { id: "experiments", title: "Experiments", href: START },
  { id: "learn", title: "Learn", href: "learn" },
  { id: "failures", title: "Failures", href: "failures" },
  { id: "lectures", title: "Lectures", href: "lectures" },
  { id: "work", title: "My work", href: "work" },
  { id: "help", title: "Help", href: "help/" },
];

const LIST = "site-places";
const CONTENT = "content";

/** Fill the header of the page: links after the name of the site, as a menu on a narrow page, and the page's tools. A participant of a
 * class has no links.
 *
 * @param {Place|null} current The part that the page belongs to.
 * @param {Child} [tools] Tools before the switch of colours.
 */
export function navigation(current, tools = null) {
  const first = document.querySelector(".top .brand");
  if (isParticipant) first?.replaceWith(elementOf(h(Brand, {})));
  else {
    first?.after(elementOf(h(Places, { current })));
    skipLink();
  }
  render([tools, h(ThemeButton, {})], part("tools"));
}

/** @param {{current: Place|null}} props */
function Places({ current }) {
  const links = PLACES.map(({ id, title, href }) => html`<li><a href=${href} aria-current=${id === current ? "page" : null}>${title}</a></li>`);
  return html`<nav class="places" aria-label="Parts of the site">
    <button type="button" class="quiet icon-only" popovertarget=${LIST} aria-label="All parts" title="All parts">${h(Icon, { name: "menu" })}</button>
    <ul id=${LIST} popover="auto">${links}</ul>
  </nav>`;
}

/** The first tab stop leads to the content of the page. */
export function skipLink() {
  const main = document.querySelector("main");
  if (main === null) return;
  main.id ||= CONTENT;
  main.tabIndex = -1;
  document.querySelector(".top")?.prepend(build("a", { class: "skip", href: here(main.id), on: { click: skip } }, "Skip to the content"));

  /** @param {MouseEvent} event */
  function skip(event) {
    // The address's fragment may hold a run or an upload, so it must not change.
    event.preventDefault();
    document.querySelector("main")?.focus();
  }
}

export const END_FORK = "End your copy and free its place";

/** End a follower's own copy, and go back to the class. */
export async function endFork() {
  if ((await attempt(() => request("DELETE follow/fork"))) !== undefined) location.assign(START);
}

// The guided tour as a link, and its state in this browser.

const NAME = "tour";
const KEY = "pftrack-tour";

/** The address of the tour: a session of the first preset with a tour; null if there is none.
 *
 * @param {ExperimentPublic[]} experiments
 */
export function tourLink(experiments) {
  for (const experiment of experiments) {
    const preset = experiment.presets.find(({ tour }) => tour !== null);
    if (preset === undefined) continue;
    const [page, recipe] = linkTo({ recipe: presetRecipe(experiment, preset) }).split("#");
    return `${page}?${NAME}=${encodeURIComponent(preset.name)}#${recipe}`;
  }
  return null;
}

/** The preset whose tour the page's address names; null if there is none. */
export function tourOfAddress() {
  return new URLSearchParams(location.search).get(NAME);
}

/** From now on a reload shows the session without the tour. */
export function leaveAddress() {
  const address = new URL(location.href);
  address.searchParams.delete(NAME);
  history.replaceState(null, "", address);
}

/** Whether the tour was taken or left in this browser. */
export function isTourKnown() {
  return remembered(KEY) !== null;
}

/** @param {"done"|"left"} how How it ended. */
export function rememberTour(how) {
  remember(KEY, how);
}

const NOT_FOUND = 404;

/**
 * Show a page: its navigation, its tools, and its content in the place of that name.
 *
 * @param {string} name
 * @param {Place|null} place The part of the site that it belongs to.
 * @param {Component<{}>} Content
 * @param {Child} [tools] Tools before the switch of colours.
 */
export function showPage(name, place, Content, tools = null) {
  navigation(place, tools);
  render(h(Content, {}), part(name));
}

/** Content that is loaded: until then `bones`, if loading takes long; after an error, a notice with a button to try again.
 *
 * @param {{load: () => Promise<Child>, failed: string, bones?: Child, unknown?: {title: string, action: Action}}} props `failed` is the
 error's title; `unknown` is the notice for a missing item. */
export function Loaded({ load, failed, bones = null, unknown }) {
  const shown = useSignal(/** @type {Child} */ (null));
  const begin = async () => {
    // The old notice is removed with its button, so that nobody requests twice at a time.
    shown.value = html`<div class="made late">${bones}</div>`;
    try {
      shown.value = await load();
    } catch (error) {
      const isUnknown = unknown !== undefined && statusOf(error) === NOT_FOUND;
      const message = messageOf(error);
      shown.value = isUnknown ? h(Notice, { ...unknown, message, inline: false }) : h(Failed, { title: failed, message, again: begin });
    }
  };
  useEffect(() => void begin(), []);
  return shown.value;
}

/** A notice with the reason of an error, and a button to try again.
 *
 * @param {{title: string, message: string, again: () => void}} props
 */
export function Failed({ title, message, again }) {
  return h(Notice, { title, message, action: { label: "Try again", run: again }, inline: true });
}

/** An element made by other code, such as a figure on a canvas.
 *
 * @param {{make: (end: AbortSignal) => Node}} props `end` is aborted when it is removed.
 */
export function Made({ make }) {
  const place = useRef(/** @type {HTMLElement|null} */ (null));
  useEffect(() => {
    const end = new AbortController();
    place.current?.replaceChildren(make(end.signal));
    return () => end.abort();
  }, []);
  return html`<div class="made" ref=${place}></div>`;
}

/** A button that is disabled until its action is done.
 *
 * @param {{label: string, run: () => Promise<unknown>, disabled?: boolean, [attribute: string]: unknown}} props
 */
export function Doing({ label, run, disabled = false, ...attributes }) {
  const isBusy = useSignal(false);
  const press = async () => {
    isBusy.value = true;
    await run();
    isBusy.value = false;
  };
  return html`<button type="button" ...${attributes} disabled=${disabled || isBusy.value} onClick=${press}>${label}</button>`;
}

/** @param {{address: string}} props A picture that keeps its place while it loads, and leaves a plain field if it fails. */
export function Thumbnail({ address }) {
  const fail = (/** @type {Event & {currentTarget: HTMLElement}} */ { currentTarget }) => currentTarget.classList.add("missing");
  return html`<img loading="lazy" src=${address} alt="" width="320" height="240" onError=${fail} />`;
}
