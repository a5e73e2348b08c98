/** What all pages made of components share: the frame around the content, and what is asked of the server. */

import { messageOf, statusOf } from "./api.js";
import { part } from "./dom.js";
import { navigation } from "./navigation.js";
import { Notice } from "./notice.js";
import { themeButton } from "./theme.js";
import { h, html, render, useEffect, useRef, useSignal } from "../vendor/preact.js";

/** @import { Place } from "./navigation.js" */
/** @import { Action } from "./notice.js" */
/** @import { Child, Component } from "../vendor/preact.js" */

const NOT_FOUND = 404;

/**
 * Show a page: its navigation, its tools, and its content in the place that has its name.
 *
 * @param {string} name
 * @param {Place|null} place The part of the site that it belongs to.
 * @param {Component<{}>} Content
 * @param {Node[]} [tools] Before the switch of the colours.
 */
export function showPage(name, place, Content, tools = []) {
  navigation(place);
  part("tools").append(...tools, themeButton());
  render(h(Content, {}), part(name));
}

/**
 * What has to be asked for, once it is there: until then `bones`, where that takes long, and what went wrong with a way to ask again.
 *
 * @param {{load: () => Promise<Child>, failed: string, bones?: Child, unknown?: {title: string, action: Action}}} props `failed` is a
 *     title for what went wrong; `unknown` what to say instead where the server knows no such thing.
 */
export function Loaded({ load, failed, bones = null, unknown }) {
  const shown = useSignal(/** @type {Child} */ (null));
  const begin = async () => {
    // What failed before is gone with its button, so that nobody asks twice at a time.
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

/**
 * Why something cannot be shown, with a button to ask again.
 *
 * @param {{title: string, message: string, again: () => void}} props
 */
export function Failed({ title, message, again }) {
  return h(Notice, { title, message, action: { label: "Try again", run: again }, inline: true });
}

/**
 * An element that is made elsewhere, such as a figure on a canvas.
 *
 * @param {{make: (end: AbortSignal) => Node}} props `end` comes when it is taken away.
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

/**
 * A button that cannot be pressed again until what it does is done.
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

/** @param {{address: string}} props A picture that keeps its place while it loads, and leaves a plain field if it cannot. */
export function Thumbnail({ address }) {
  const fail = (/** @type {Event & {currentTarget: HTMLElement}} */ { currentTarget }) => currentTarget.classList.add("missing");
  return html`<img loading="lazy" src=${address} alt="" width="320" height="240" onError=${fail} />`;
}
