/** The visitor: a follower or a lecturer by the link of a class; and the browser's storage for a person. */

import { html } from "../vendor/preact.js";
import { START } from "./api.js";

// Storage of this browser for a person, and of a tab. If the browser stores nothing, values last as long as the page.

/** The result of the browser's storage; null if it is disabled or full.
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
 * @returns {boolean} Whether the browser stored it.
 */
export function remember(name, value) {
  return stored(() => localStorage.setItem(name, value)) !== null;
}

/** A value stored for this tab.
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

/** Whether the visitor is a participant of a class, who may not see the rest of the server. */
export const isParticipant = role !== "";

/** Whether the participant is a follower with an own copy. */
export const isFollower = role === "follower";

/** The class of the link, if the page was opened by one. */
export const classOfLink = classLink;

/** The first element of the header: a link to the start page, or for followers back to the class. */
export function Brand() {
  if (isFollower) return html`<a class="button" href=${START} data-role="back">Back to the class</a>`;
  return isParticipant ? html`<span class="brand">pftrack</span>` : html`<a class="brand" href=${START}>pftrack</a>`;
}
