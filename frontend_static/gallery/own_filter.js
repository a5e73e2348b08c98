/** The way to a filter of one's own: the commands by which one begins, or the files that the server was started with. */

import { api } from "../shared/api.js";
import { copyButton } from "../shared/copy.js";
import { fill, h } from "../shared/dom.js";
import { linkTo } from "../shared/share_link.js";

/** @import { FilterPublic } from "../shared/messages.js" */

/** Written into the page by the server, which knows where its shell finds the program. */
const COMMANDS = document.documentElement.dataset.commands ?? "";

/** @param {HTMLElement} root */
export async function offerOwnFilter(root) {
  show(root, "Write your own filter", begin());
  const files = await api.filters().catch(() => []);
  if (files.length > 0) show(root, "Your filter", h("footer", {}, files.map(open)));
}

/**
 * @param {HTMLElement} root
 * @param {string} title
 * @param {HTMLElement} way
 */
function show(root, title, way) {
  fill(root, h("h2", {}, title), h("p", { class: "hint" }, "One Python file. Save it, and the running session goes on with the new code."), way);
}

/** @param {FilterPublic} file */
function open({ name, file, experiment }) {
  return h("a", { class: "button primary", href: linkTo({ recipe: { experiment, tracker: name } }) }, `Open ${file}`);
}

function begin() {
  return h("div", { class: "own-commands" }, h("pre", { tabindex: 0, "aria-label": "Commands" }, COMMANDS), copyButton("Copy", COMMANDS, "the commands"));
}
