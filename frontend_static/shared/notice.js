/** Shown in the place of something that cannot be shown: why, and the one way on, if there is one. */

import { elementOf } from "./dom.js";
import { h, html } from "../vendor/preact.js";

/** @typedef {{label: string, href?: string, run?: () => void}} Action */

/** @param {{title: string, message: string, action: Action|null, inline: boolean}} props `inline`: among other things instead of over a dimmed scene. */
export function Notice({ title, message, action, inline }) {
  return html`<div class=${inline ? "notice inline" : "notice"} role="alert" data-said=${`${title} ${message}`}>
    <h2>${title}</h2>
    <p>${message}</p>
    ${action?.href && html`<a class="button primary" href=${action.href}>${action.label}</a>`}
    ${action?.run && html`<button type="button" class="primary" onClick=${action.run}>${action.label}</button>`}
  </div>`;
}

/**
 * @param {string} title
 * @param {string} message
 * @param {Action|null} action
 * @param {{inline?: boolean}} [options]
 * @returns {HTMLElement}
 */
export function notice(title, message, action, { inline = false } = {}) {
  return elementOf(h(Notice, { title, message, action, inline }));
}
