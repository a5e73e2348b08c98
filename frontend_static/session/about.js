/** What an experiment is about, and what it comes from. */

import { Citations, REFERENCES } from "../shared/citations.js";
import { openDialog } from "../shared/dialog.js";
import { elementOf, h } from "../shared/dom.js";
import { GLOSSARY } from "../shared/terms.js";
import { isParticipant } from "../shared/participant.js";
import { h as component } from "../vendor/preact.js";

/** @param {import("../shared/messages.js").ExperimentPublic} experiment */
export function aboutDialog({ id, title, question, description, references }) {
  openDialog(title, () => [
    h("p", { class: "question" }, question),
    h("p", {}, description),
    elementOf(component(Citations, { title, citations: references })),
    !isParticipant && h("p", {}, h("a", { href: `${REFERENCES}#${encodeURIComponent(id)}` }, "All references"), " · ", h("a", { href: GLOSSARY }, "Glossary")),
  ], { wide: true });
}
