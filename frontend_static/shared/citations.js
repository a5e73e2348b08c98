/** What an experiment comes from, to be read and to be copied. */

import { CopyButton } from "./copy.js";
import { h, html } from "../vendor/preact.js";

/** @import { CitationPublic } from "./messages.js" */

/** Where all references are. */
export const REFERENCES = "references";

/**
 * The citations of an experiment, with buttons that copy all of them.
 *
 * @param {{title: string, citations: CitationPublic[]}} props `title` of the experiment.
 */
export function Citations({ title, citations }) {
  return html`<div class="citations">
    ${citations.map(({ text }) => html`<p>${text}</p>`)}
    <div class="citation-tools">
      ${h(CopyButton, { label: "Copy citation", text: citations.map(({ text }) => text).join("\n"), what: title })}
      ${h(CopyButton, { label: "Copy BibTeX", text: citations.map(({ bibtex }) => bibtex).join("\n"), what: title })}
    </div>
  </div>`;
}
