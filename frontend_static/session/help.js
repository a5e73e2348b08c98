/** Dialogs that explain: the list of keys, and what an experiment is about and comes from. */

import { api } from "../shared/api.js";
import { Citations, REFERENCES } from "../shared/citations.js";
import { openDialog, openKeys } from "../shared/dialog.js";
import { elementOf, h } from "../shared/dom.js";
import { isParticipant } from "../shared/participant.js";
import { GLOSSARY } from "../shared/terms.js";
import { tourLink } from "../shared/tour_link.js";
import { h as component } from "../vendor/preact.js";
import { HELP } from "./keys.js";

export function helpDialog() {
  const tour = h("p", {});
  if (!isParticipant) offerTour(tour);
  openKeys(HELP.map(({ keys, what }) => [keys, what]), tour, !isParticipant && h("p", {}, h("a", { href: GLOSSARY }, "Glossary: what the words mean")));
}

/** @param {HTMLElement} place Stays empty where there is no tour. */
async function offerTour(place) {
  try {
    const href = tourLink(await api.experiments());
    if (href !== null) place.append(h("a", { href, data: { role: "tour" } }, "Take the guided tour"));
  } catch {
    // The keys are what was asked for.
  }
}

/** @param {import("../shared/messages.js").ExperimentPublic} experiment */
export function aboutDialog({ id, title, question, description, references }) {
  openDialog(title, () => [
    h("p", { class: "question" }, question),
    h("p", {}, description),
    elementOf(component(Citations, { title, citations: references })),
    !isParticipant && h("p", {}, h("a", { href: `${REFERENCES}#${encodeURIComponent(id)}` }, "All references"), " · ", h("a", { href: GLOSSARY }, "Glossary")),
  ], { wide: true });
}
