/** The list of keys. */

import { api } from "../shared/api.js";
import { openDialog } from "../shared/dialog.js";
import { h } from "../shared/dom.js";
import { isParticipant } from "../shared/participant.js";
import { tourLink } from "../shared/tour_link.js";
import { HELP } from "./keys.js";

/** @param {{name: string, title: string}[]} presets */
export function helpDialog(presets) {
  const tour = h("p", {});
  if (!isParticipant) offerTour(tour);
  openDialog("Keys", () => [
    h(
      "dl",
      { class: "keys" },
      HELP.map(({ keys, what }) => [h("dt", {}, keys.split(" ").map((key) => (key === "–" ? " – " : h("kbd", {}, key)))), h("dd", {}, what)]),
    ),
    presets.length > 0 && h("p", { class: "hint" }, `Presets: ${presets.map(({ title }, index) => `${index + 1} ${title}`).join(", ")}`),
    tour,
  ]);
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
