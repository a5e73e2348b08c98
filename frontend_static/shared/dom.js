/**
 * Building page elements, and the elements that all pages share. Text is inserted only as text nodes, so a person's text cannot become
 markup. */

import { h, html, render, useRef } from "../vendor/preact.js";
import { messageOf } from "./api.js";

/** @import { VNode } from "../vendor/preact.js" */
/** @import { Child, Properties } from "./elements.js" */

// Controls for a choice.

/** An option: its value, its label, its group in a list, and whether it is disabled.
 *
 * @typedef {{value: string, words: string, hint?: string, group?: string, isOff?: boolean}} Option
 */

/** @typedef {{label: string, options: readonly Option[], value: string, choose: (value: string) => void}} Props */

/** @param {Props & {field?: string, [attribute: string]: unknown}} props `field` is the server's name of it. */
export function Select({ label, options, value, choose, field, ...attributes }) {
  const groups = [...new Set(options.map(({ group = "" }) => group))].map((group) => {
    const members = options.filter((option) => (option.group ?? "") === group).map((option) => html`<option value=${option.value}>${option.words}</option>`);
    return group ? html`<optgroup label=${group}>${members}</optgroup>` : members;
  });
  const change = (/** @type {{currentTarget: HTMLSelectElement}} */ { currentTarget }) => choose(currentTarget.value);
  return html`<select ...${attributes} aria-label=${label} data-field=${field} value=${value} onChange=${change}>${groups}</select>`;
}

/** @param {Props} props A row of buttons; the pressed one is chosen. */
export function Segments({ label, options, value, choose }) {
  const buttons = options.map(({ value: own, words, hint, isOff = false }) =>
    html`<button type="button" title=${hint} disabled=${isOff} aria-pressed=${own === value} onClick=${() => choose(own)}>${words}</button>`,
  );
  return html`<span class="segments" role="group" aria-label=${label}>${buttons}</span>`;
}

/**
 * Check boxes; at most `most` can be checked.
 *
 * @param {{
 *   options: readonly {value: string, words: import("../vendor/preact.js").Child, hint?: string}[],
 *   chosen: readonly string[],
 *   choose: (chosen: string[]) => void,
 *   most?: number,
 * }} props
 */
export function Boxes({ options, chosen, choose, most = Infinity }) {
  return options.map(({ value, words, hint }) => {
    const isChosen = chosen.includes(value);
    const isOff = !isChosen && chosen.length >= most;
    const toggle = () => choose(options.map((each) => each.value).filter((each) => chosen.includes(each) !== (each === value)));
    return html`<label title=${hint}><input type="checkbox" value=${value} checked=${isChosen} disabled=${isOff} onChange=${toggle} />${words}</label>`;
  });
}

/**
 * A button that opens files.
 *
 * @param {{
 *   name: string,
 *   label: string,
 *   words: import("../vendor/preact.js").Child,
 *   title: string,
 *   accept: string,
 *   take: (files: File[]) => void,
 *   look?: string,
 * }} props `look` adds CSS classes to the button.
 */
export function FileButton({ name, label, words, title, accept, take, look = "" }) {
  const send = (/** @type {Event & {currentTarget: HTMLInputElement}} */ { currentTarget: input }) => {
    const files = [...(input.files ?? [])];
    input.value = "";
    if (files.length > 0) take(files);
  };
  return html`<label class=${`button ${look}`} title=${title}>
    ${words}<input type="file" accept=${accept} class="visually-hidden" aria-label=${label} data-file=${name} onChange=${send} />
  </label>`;
}

/**
 * Make an element.
 *
 * @template {keyof HTMLElementTagNameMap} Tag
 * @param {Tag} tag
 * @param {Properties} [properties]
 * @param {...Child} children
 */
export function build(tag, { on = {}, data = {}, ...attributes } = {}, ...children) {
  const element = document.createElement(tag);
  // Each listener takes events of its own type, which this type does not distinguish.
  for (const [type, listener] of Object.entries(on)) element.addEventListener(type, /** @type {EventListener} */ (listener));
  Object.assign(element.dataset, data);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === true) element.setAttribute(name, "");
    else if (value !== false && value !== null && value !== undefined) element.setAttribute(name, String(value));
  }
  return fill(element, ...children);
}

/**
 * A place of the page by its name.
 *
 * @param {string} name
 * @returns {HTMLElement}
 */
export function part(name) {
  const found = document.querySelector(`[data-part="${name}"]`);
  if (!(found instanceof HTMLElement)) throw new Error(`The page has no part ${name}`);
  return found;
}

/** The last part of the page's address, or an earlier one.
 *
 * @param {number} [before]
 */
export function lastOfAddress(before = 0) {
  return decodeURIComponent(location.pathname.split("/").filter(Boolean).at(-1 - before) ?? "");
}

/** Replace the content of an element; strings become text.
 *
 * @template {Element} E
 * @param {E} element
 * @param {...Child} children
 */
export function fill(element, ...children) {
  const shown = /** @type {readonly unknown[]} */ (children).flat(Infinity).filter((child) => child !== null && child !== undefined && child !== false);
  element.replaceChildren(.../** @type {(Node|string)[]} */ (shown));
  return element;
}

/**
 * Set an element's text, touching the page only when it differs.
 *
 * @param {Element} element
 * @param {string} text
 */
export function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** @typedef {Record<string, [right: number, down: number]>} Ways The direction of each key, by its code or its name. */

/** @type {Ways} */
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
/** With shift. */
const FAR = 10;

/**
 * Return the step of a key: one, or ten with shift; null for any other key.
 *
 * @param {KeyboardEvent} event
 * @param {Ways} [ways]
 * @returns {[right: number, down: number]|null}
 */
export function step(event, ways = ARROWS) {
  const way = event.ctrlKey || event.metaKey || event.altKey ? undefined : (ways[event.code] ?? ways[event.key]);
  if (way === undefined) return null;
  event.preventDefault();
  event.stopPropagation();
  const far = event.shiftKey ? FAR : 1;
  return [far * way[0], far * way[1]];
}

/**
 * Render a component into a place until the end.
 *
 * @param {Element} place
 * @param {import("../vendor/preact.js").Child} content
 * @param {AbortSignal} end
 */
export function renderIn(place, content, end) {
  render(content, place);
  end.addEventListener("abort", () => render(null, place));
}

/** The element of a component, for a page that is not made of components.
 *
 * @template {Element} E
 * @param {VNode} component
 * @returns {E}
 */
export function elementOf(component) {
  const place = document.createElement("div");
  render(component, place);
  return /** @type {E} */ (place.firstElementChild);
}

// Line icons on a 16 px grid, drawn in the colour of the text around them.

/**
 * Paths; one may be filled instead of stroked.
 *
 * @satisfies {Record<string, [path: string, isFilled?: boolean]>}
 */
const PATHS = {
  play: ["M4.5 2.8v10.4l8.6-5.2z", true],
  pause: ["M4 3h3v10H4zM9 3h3v10H9z", true],
  next: ["M6 3l5 5-5 5"],
  previous: ["M10 3L5 8l5 5"],
  first: ["M12 3L7 8l5 5M4.5 3v10"],
  last: ["M4 3l5 5-5 5M11.5 3v10"],
  replay: ["M3.5 8a4.5 4.5 0 1 0 1.7-3.5M5 1.8v3h3"],
  bookmark: ["M4.5 2.5h7v11L8 10.8 4.5 13.5z"],
  branch: [
    "M4.5 5.5v5M4.5 8.5c4 0 7-.5 7-3" +
      "M4.5 5.5a1.5 1.5 0 1 0 0-3 1.5 1.5 0 0 0 0 3zM4.5 13.5a1.5 1.5 0 1 0 0-3 1.5 1.5 0 0 0 0 3zM11.5 5.5a1.5 1.5 0 1 0 0-3 1.5 1.5 0 0 0 0 3z",
  ],
  compare: ["M2.5 3h4.5v10H2.5zM9 3h4.5v10H9z"],
  sweep: ["M2.5 2.5h11v11h-11zM2.5 6.2h11M2.5 9.8h11M6.2 2.5v11M9.8 2.5v11"],
  inspect: ["M7 11.5a4.5 4.5 0 1 0 0-9 4.5 4.5 0 0 0 0 9zM10.3 10.3l3.2 3.2M7 5.2v3.6M5.2 7h3.6"],
  save: ["M8 2.5v7.5M4.8 7L8 10.2 11.2 7M2.5 11v2.5h11V11"],
  code: ["M5.5 4.5 2 8l3.5 3.5M10.5 4.5 14 8l-3.5 3.5"],
  share: ["M6.5 9.5a2.7 2.7 0 0 0 4 .2l2-2a2.7 2.7 0 0 0-3.8-3.8l-1 1M9.5 6.5a2.7 2.7 0 0 0-4-.2l-2 2a2.7 2.7 0 0 0 3.8 3.8l1-1"],
  rename: ["M3 13l.6-2.8 7-7 2.2 2.2-7 7zM9.3 4.5l2.2 2.2"],
  trash: ["M3 4.5h10M6.5 4.5v-2h3v2M4.5 4.5l.6 9h5.8l.6-9"],
  print: ["M4.5 6V2.5h7V6M4.5 11.5h-2V6h11v5.5h-2M4.5 9.5h7v4h-7z"],
  close: ["M4 4l8 8M12 4l-8 8"],
  sun: ["M8 5a3 3 0 1 0 0 6 3 3 0 0 0 0-6zM8 1.5v1.5M8 13v1.5M1.5 8H3M13 8h1.5M3.4 3.4l1 1M11.6 11.6l1 1M12.6 3.4l-1 1M4.4 11.6l-1 1"],
  moon: ["M13 9.6A5.5 5.5 0 0 1 6.4 3 5.5 5.5 0 1 0 13 9.6z"],
  auto: ["M8 2.5a5.5 5.5 0 1 0 0 11zM8 2.5a5.5 5.5 0 0 1 0 11"],
  enlarge: ["M9.5 2.5h4v4M13.5 2.5L9.2 6.8M6.5 13.5h-4v-4M2.5 13.5l4.3-4.3"],
  shrink: ["M13.5 6.5h-4v-4M9.5 6.5l4.3-4.3M2.5 9.5h4v4M6.5 9.5l-4.3 4.3"],
  about: ["M8 2a6 6 0 1 0 0 12A6 6 0 0 0 8 2zM8 7.4v3.8M8 4.7v.2"],
  check: ["M3 8.5l3.5 3.5L13 4.5"],
  presets: ["M6 4h7.5M6 8h7.5M6 12h7.5M2.5 4h1M2.5 8h1M2.5 12h1"],
  menu: ["M2.5 4h11M2.5 8h11M2.5 12h11"],
  more: ["M3.5 8h.01M8 8h.01M12.5 8h.01"],
  up: ["M8 13V3.5M4 7.5l4-4 4 4"],
  down: ["M8 3v9.5M4 8.5l4 4 4-4"],
  class: ["M8 7.5a2.2 2.2 0 1 0 0-4.4 2.2 2.2 0 0 0 0 4.4zM3.5 13c0-2.6 2-4 4.5-4s4.5 1.4 4.5 4M2.2 8.2a1.6 1.6 0 1 1 1.6-2.6M13.8 8.2a1.6 1.6 0 1 0-1.6-2.6"],
  camera: ["M2.5 5.5h2.7l1.2-2h3.2l1.2 2h2.7v7.5h-11zM8 11a2.3 2.3 0 1 0 0-4.6 2.3 2.3 0 0 0 0 4.6z"],
  files: ["M4 2.5h5l3 3v8H4zM9 2.5v3h3M6 8.5h4M6 11h4"],
  film: ["M2.5 3.5h11v9h-11zM5 3.5v9M11 3.5v9M2.5 6.5H5M2.5 9.5H5M11 6.5h2.5M11 9.5h2.5"],
};

/** @typedef {keyof typeof PATHS} IconName */

/** @param {{name: IconName}} props */
export function Icon({ name }) {
  const [path, solid = false] = /** @type {[string, boolean?]} */ (PATHS[name]);
  const pen = solid ? { fill: "currentColor", stroke: "none" } : { fill: "none", stroke: "currentColor" };
  return html`<svg viewBox="0 0 16 16" width="16" height="16" class="icon" aria-hidden="true" focusable="false">
    <path d=${path} stroke-width="1.5" stroke-linecap="round" stroke-linejoin="round" ...${pen} />
  </svg>`;
}

/**
 * A button with an icon alone.
 *
 * @param {{name: IconName, title: string, run: () => void, [attribute: string]: unknown}} props `title` names its action.
 */
export function IconButton({ name, title, run, ...attributes }) {
  return html`<button type="button" class="quiet icon-only" title=${title} aria-label=${title} ...${attributes} onClick=${run}>${h(Icon, { name })}</button>`;
}

/** @typedef {{id: string, title: string}} Neighbour */

/**
 * Links to the pages before and after, of lessons or failures.
 *
 * @param {{
 *   kind: string,
 *   previous: Neighbour|null|undefined,
 *   next: Neighbour|null|undefined,
 *   title: (way: string, title: string) => string,
 *   go: () => void,
 * }} props `kind` begins their addresses; `go` runs before.
 */
export function Neighbours({ kind, previous, next, title, go }) {
  const link = (/** @type {Neighbour} */ to, /** @type {"previous"|"next"} */ name, /** @type {string} */ rel, /** @type {string} */ way) => {
    const words = title(way, to.title);
    const href = `${kind}/${encodeURIComponent(to.id)}`;
    return html`<a class="button quiet icon-only" rel=${rel} href=${href} title=${words} aria-label=${words} onClick=${go}>${h(Icon, { name })}</a>`;
  };
  return [previous && link(previous, "previous", "prev", "Previous"), next && link(next, "next", "next", "Next")];
}

// Short messages at the lower edge. News disappears by itself; errors stay until they are closed.

const NEWS_MS = 5000;

/** The stack of messages: within an open dialog, since everything else is dimmed and unreachable then. */
function stackOfPage() {
  const stack = document.querySelector(".toasts") ?? build("div", { class: "toasts", role: "status", "aria-live": "polite" });
  const place = document.querySelector("dialog[open]") ?? document.body;
  if (stack.parentElement !== place) place.append(stack);
  return stack;
}

/**
 * @param {string} message
 * @param {{kind?: "news"|"error", action?: {label: string, href?: string, run?: () => void}}} [options]
 */
export function toast(message, { kind = "news", action } = {}) {
  const stack = stackOfPage();
  for (const shown of stack.querySelectorAll(".toast")) if (shown instanceof HTMLElement && shown.dataset.message === message) shown.remove();
  const close = () => element.remove();
  const run = () => {
    close();
    action?.run?.();
  };
  const element = elementOf(html`<div class=${`toast ${kind}`} role=${kind === "error" ? "alert" : null} data-message=${message}>
    <span class="toast-text">${message}</span>
    ${action?.href && html`<a class="button quiet" href=${action.href} onClick=${close}>${action.label}</a>`}
    ${action?.run && html`<button type="button" class="quiet" onClick=${run}>${action.label}</button>`}
    ${h(IconButton, { name: "close", title: "Close this message", run: close })}
  </div>`);
  stack.append(element);
  while (stack.children.length > 3) stack.firstElementChild?.remove();
  if (kind === "news") setTimeout(close, NEWS_MS);
}

/** Run a request to the server; show its error once, here.
 *
 * @template T
 * @param {() => Promise<T>} work
 * @returns {Promise<T|undefined>}
 */
export async function attempt(work) {
  try {
    return await work();
  } catch (error) {
    toast(messageOf(error), { kind: "error" });
    return undefined;
  }
}

// A button that copies a text.

/**
 * @param {{label: string, text: string, what: string}} props `what` describes the copied text, for users of screen readers.
 */
export function CopyButton({ label, text, what }) {
  const copy = async () => {
    try {
      await navigator.clipboard.writeText(text);
      toast("Copied");
    } catch {
      toast("The browser does not let this page copy; select the text and copy it with the keyboard", { kind: "error" });
    }
  };
  return html`<button type="button" aria-label=${`${label}: ${what}`} onClick=${copy}>${label}</button>`;
}

// A notice in place of content that cannot be shown: the reason, and the one action, if there is one.

/** @typedef {{label: string, href?: string, run?: () => void}} Action */

/** @param {{title: string, message: string, action: Action|null, inline: boolean}} props `inline`: among other content instead of over a
 * dimmed scene. */
export function Notice({ title, message, action, inline }) {
  return html`<div class=${inline ? "notice inline" : "notice"} role="alert" data-said=${`${title} ${message}`}>
    <h2>${title}</h2>
    <p>${message}</p>
    ${action?.href && html`<a class="button primary" href=${action.href}>${action.label}</a>`}
    ${action?.run && html`<button type="button" class="primary" onClick=${action.run}>${action.label}</button>`}
  </div>`;
}

// The tooltip at the pointer.

/** @typedef {{x: number, y: number, below: number}} Place In the window, px: the middle of an upper edge, and the lower edge. */

const AWAY_PX = 10;
const MARGIN_PX = 8;

export class Tooltip {
  #attributes;
  /** @type {HTMLElement|null} Made when it is first shown. */
  #element = null;

  /** @param {Properties} attributes */
  constructor(attributes) {
    this.#attributes = attributes;
  }

  hide() {
    if (this.#element !== null) this.#element.hidden = true;
  }

  /**
   * @param {Child} content
   * @param {Place} place
   * @param {Element} [within] Its parent; an open dialog covers everything else.
   */
  show(content, place, within = document.body) {
    this.#element ??= build("div", { class: "tooltip", ...this.#attributes });
    if (this.#element.parentElement !== within) within.append(this.#element);
    fill(this.#element, content);
    this.#element.hidden = false;
    this.move(place);
  }

  /** @param {Place} place */
  move(place) {
    if (this.#element === null) return;
    const { width, height } = this.#element.getBoundingClientRect();
    const left = Math.min(Math.max(place.x - width / 2, MARGIN_PX), innerWidth - width - MARGIN_PX);
    const above = place.y - height - AWAY_PX;
    Object.assign(this.#element.style, { left: `${left}px`, top: `${above >= MARGIN_PX ? above : place.below + AWAY_PX}px` });
  }
}

/** The tooltip of the pointer, shared by the whole page. */
export const tip = new Tooltip({ role: "status" });

// A button with a small sheet next to it (`.menu` of the style sheet), which closes on a click elsewhere.

let made = 0;

/**
 * @typedef {object} PopoverProps
 * @property {IconName} [icon]
 * @property {string} label Its name.
 * @property {string} title
 * @property {import("../vendor/preact.js").Child} [words] Text next to the icon.
 * @property {import("../vendor/preact.js").Child} content
 */

/** @param {PopoverProps & {[attribute: string]: unknown}} props The attributes are those of the button. */
export function Popover({ icon: name, label, title, words = null, content, ...attributes }) {
  const id = useRef("");
  id.current ||= `menu-${(made += 1)}`;
  const look = { title, class: words === null ? "icon-only" : "", "aria-label": label, ...attributes };
  return html`<div class="menu-root">
    <button type="button" popovertarget=${id.current} ...${look}>${name && h(Icon, { name })}${words}</button>
    <div class="menu" id=${id.current} popover="auto">${content}</div>
  </div>`;
}
