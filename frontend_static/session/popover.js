/** A button with a small sheet over it, which closes when somebody clicks elsewhere. */

import { h } from "../shared/dom.js";

const EDGE_PX = 8;
const GAP_PX = 6;

/**
 * @param {HTMLButtonElement} button
 * @param {...Node} content
 */
export function popover(button, ...content) {
  const menu = h("div", { class: "menu", popover: "auto" }, content);
  button.popoverTargetElement = menu;
  menu.addEventListener("toggle", (event) => {
    if (event.newState !== "open") return;
    const from = button.getBoundingClientRect();
    menu.style.left = `${Math.max(EDGE_PX, Math.min(from.left, innerWidth - menu.offsetWidth - EDGE_PX))}px`;
    const isAbove = from.top > innerHeight - from.bottom;
    menu.style.bottom = isAbove ? `${innerHeight - from.top + GAP_PX}px` : "auto";
    menu.style.top = isAbove ? "auto" : `${from.bottom + GAP_PX}px`;
    menu.style.maxHeight = `${(isAbove ? from.top : innerHeight - from.bottom) - GAP_PX - EDGE_PX}px`;
  });
  return h("div", { class: "menu-root" }, button, menu);
}
