/** A button with a small sheet beside it (`.menu` of the style sheet), which closes when somebody clicks elsewhere. */

import { Icon } from "../shared/icons.js";
import { h, html, useRef } from "../vendor/preact.js";

/** @import { IconName } from "../shared/icons.js" */
/** @import { Child } from "../vendor/preact.js" */

let made = 0;

/**
 * @typedef {object} PopoverProps
 * @property {IconName} [icon]
 * @property {string} label Its name.
 * @property {string} title
 * @property {Child} [words] Beside the icon.
 * @property {Child} content
 */

/** @param {PopoverProps & {[attribute: string]: unknown}} props The attributes are those of the button. */
export function Popover({ icon, label, title, words = null, content, ...attributes }) {
  const id = useRef("");
  id.current ||= `menu-${(made += 1)}`;
  const look = { title, class: words === null ? "icon-only" : "", "aria-label": label, ...attributes };
  return html`<div class="menu-root">
    <button type="button" popovertarget=${id.current} ...${look}>${icon && h(Icon, { name: icon })}${words}</button>
    <div class="menu" id=${id.current} popover="auto">${content}</div>
  </div>`;
}
