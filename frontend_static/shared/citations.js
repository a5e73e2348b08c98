/** What an experiment comes from, to be read and to be copied. */

import { copyButton } from "./copy.js";
import { h } from "./dom.js";

/** @import { CitationPublic } from "./messages.js" */

/** Where all references are. */
export const REFERENCES = "references";

/**
 * The citations of an experiment, with buttons that copy all of them.
 *
 * @param {string} title Of the experiment.
 * @param {CitationPublic[]} citations
 */
export function citationList(title, citations) {
  return h(
    "div",
    { class: "citations" },
    citations.map(({ text }) => h("p", {}, text)),
    h(
      "div",
      { class: "citation-tools" },
      copyButton("Copy citation", citations.map(({ text }) => text).join("\n"), title),
      copyButton("Copy BibTeX", citations.map(({ bibtex }) => bibtex).join("\n"), title),
    ),
  );
}
