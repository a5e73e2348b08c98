/** Text of a lesson, which the server has made HTML of: Markdown and formulas, without scripts or pictures. */

import { h } from "../shared/dom.js";

/** @import { Properties } from "../shared/elements.js" */

/**
 * An element that holds a text.
 *
 * @template {keyof HTMLElementTagNameMap} Tag
 * @param {Tag} tag
 * @param {string} html As the server gave it: all that anybody wrote is escaped there.
 * @param {Properties} [properties]
 */
export function htmlElement(tag, html, properties = {}) {
  const parsed = new DOMParser().parseFromString(html, "text/html");
  return h(tag, properties, [...parsed.body.childNodes]);
}
