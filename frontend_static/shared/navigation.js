/** The links to all parts of the site in the header of every page, and the way past them by the keyboard. */

import { START, here } from "./address.js";
import { h } from "./dom.js";
import { icon } from "./icons.js";
// Escape ends a presentation on every page of the site.
import "./presentation.js";

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

/**
 * Put the links into the header of the page, after the name of the site. Where there is little room they open as a menu.
 *
 * @param {Place|null} current The part that the page belongs to.
 */
export function navigation(current) {
  const links = PLACES.map(({ id, title, href }) => h("li", {}, h("a", { href, "aria-current": id === current ? "page" : null }, title)));
  const opener = h("button", { type: "button", class: "quiet icon-only", popovertarget: LIST, "aria-label": "All parts", title: "All parts" }, icon("menu"));
  const list = h("ul", { id: LIST, popover: "auto" }, links);
  document.querySelector(".top .brand")?.after(h("nav", { class: "places", "aria-label": "Parts of the site" }, opener, list));
  skipLink();
}

/** The first stop of the tab key leads to what the page is about. */
export function skipLink() {
  const main = document.querySelector("main");
  if (main === null) return;
  main.id ||= CONTENT;
  main.tabIndex = -1;
  document.querySelector(".top")?.prepend(h("a", { class: "skip", href: here(main.id), on: { click: skip } }, "Skip to the content"));

  /** @param {MouseEvent} event */
  function skip(event) {
    // The fragment of an address may hold a run or an upload, and has to stay.
    event.preventDefault();
    document.querySelector("main")?.focus();
  }
}
