/** What computes something again: as a link, as Python or as a command, to be copied. */

import { absolute } from "./address.js";
import { CopyButton, copyButton } from "./copy.js";
import { openDialog } from "./dialog.js";
import { elementOf, h as element } from "./dom.js";
import { Icon } from "./icons.js";
import { Loaded } from "./page.js";
import { h, html } from "../vendor/preact.js";

/** @import { SourceCode } from "./messages.js" */

/**
 * Show, ready to be copied, what computes something again.
 *
 * @param {string} title
 * @param {string[]} words What is shown; nothing for a sentence that is left out.
 * @param {() => Promise<SourceCode>} ask
 * @param {string} [link] Relative to the server's address.
 */
export function openCode(title, words, ask, link) {
  const address = link === undefined ? "" : absolute(link);
  const field = element("input", { type: "text", readonly: true, value: address, "aria-label": "Link", "data-role": "share-link", autofocus: true });
  field.addEventListener("focus", () => field.select());
  openDialog(title, (close) => [
    words.map((each) => each !== "" && element("p", {}, each)),
    address && field,
    elementOf(html`<div class="source-code">${h(Loaded, { load: () => lines(ask), failed: "The code could not be written" })}</div>`),
    element("footer", {}, element("button", { type: "button", on: { click: close } }, "Close"), address && copyButton("Copy link", address, "the link")),
  ], { wide: true });
}

/** @param {{ask: () => Promise<SourceCode>}} props */
export function CodeButton({ ask }) {
  const open = () => openCode("The same in code", ["These lines compute the same numbers where pftrack is installed."], ask);
  const title = "Copy as Python or as a command";
  return html`<button type="button" class="tool" title=${title} aria-label=${title} data-role="code" onClick=${open}>${h(Icon, { name: "code" })}</button>`;
}

/** @param {() => Promise<SourceCode>} ask */
export const sourceCodeButton = (ask) => elementOf(h(CodeButton, { ask }));

/** @param {() => Promise<SourceCode>} ask */
async function lines(ask) {
  const { python, command } = await ask();
  return [["Python", python], ["command", command]].map(([what, text]) => html`<details open=${text.length < 400}>
    <summary>As ${what}${h(CopyButton, { label: `Copy as ${what}`, text, what: "the lines" })}</summary>
    <pre tabindex="0" aria-label=${`Lines of ${what}`}>${text}</pre>
  </details>`);
}
