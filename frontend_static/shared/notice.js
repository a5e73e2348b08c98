/** What stands in the place of something that cannot be shown: why, and the one way on, if there is one. */

import { h } from "./dom.js";

/** @typedef {{label: string, href?: string, run?: () => void}} Action */

/**
 * @param {string} title
 * @param {string} message
 * @param {Action|null} action
 * @param {{inline?: boolean}} [options] Whether it stands among other things instead of over a dimmed scene.
 * @returns {HTMLElement}
 */
export function notice(title, message, action, { inline = false } = {}) {
  return h(
    "div",
    { class: inline ? "notice inline" : "notice", role: "alert", data: { said: `${title} ${message}` } },
    h("h2", {}, title),
    h("p", {}, message),
    action?.href && h("a", { class: "button primary", href: action.href }, action.label),
    action?.run && h("button", { type: "button", class: "primary", on: { click: action.run } }, action.label),
  );
}
