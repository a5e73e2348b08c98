/** The list of keys. */

import { api } from "../shared/api.js";
import { openKeys } from "../shared/dialog.js";
import { h } from "../shared/dom.js";
import { isParticipant } from "../shared/participant.js";
import { GLOSSARY } from "../shared/terms.js";
import { tourLink } from "../shared/tour_link.js";
import { HELP } from "./keys.js";

export function helpDialog() {
  const tour = h("p", {});
  if (!isParticipant) offerTour(tour);
  openKeys(HELP, tour, !isParticipant && h("p", {}, h("a", { href: GLOSSARY }, "Glossary: what the words mean")));
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
