/** Who opened this page, a follower or a lecturer by the link of a class, and what this browser remembers of a person. */

import { html } from "../vendor/preact.js";
import { START } from "./api.js";

// What this browser keeps for a person, and a tab beyond one page. Where the browser keeps nothing, it lasts as long as the page.

/**
 * What the browser's storage gives; null where there is none, or it is full.
 *
 * @template Value
 * @param {() => Value} use
 */
function stored(use) {
  try {
    return use();
  } catch {
    return null;
  }
}

/** @param {string} name */
export function remembered(name) {
  return stored(() => localStorage.getItem(name));
}

/**
 * @param {string} name
 * @param {string} value
 * @returns {boolean} Whether the browser keeps it.
 */
export function remember(name, value) {
  return stored(() => localStorage.setItem(name, value)) !== null;
}

/**
 * What this tab keeps.
 *
 * @template Value
 * @typedef {{get: () => Value|null, set: (value: Value|null) => void}} KeptInTab Null to forget it.
 */

/**
 * @template Value
 * @param {string} key
 * @returns {KeptInTab<Value>}
 */
export function keptInTab(key) {
  return {
    get: () => stored(() => JSON.parse(sessionStorage.getItem(key) ?? "null")),
    set: (value) => stored(() => sessionStorage.setItem(key, JSON.stringify(value))),
  };
}

const { role = "", class: classLink = null } = globalThis.document?.documentElement.dataset ?? {};

/** Whether the page is open to a participant of a class, who may see nothing else of the server. */
export const isParticipant = role !== "";

/** Whether that is one who follows, and tries something alone. */
export const isFollower = role === "follower";

/** The class of the link, if the page was opened by one. */
export const classOfLink = classLink;

/** The first thing in the header: the way to the start page, for followers the way back to the class. */
export function Brand() {
  if (isFollower) return html`<a class="button" href=${START} data-role="back">Back to the class</a>`;
  return isParticipant ? html`<span class="brand">pftrack</span>` : html`<a class="brand" href=${START}>pftrack</a>`;
}
