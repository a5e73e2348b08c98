/** The guided tour as a link, and what this browser remembers of it. */

import { remember, remembered } from "./memory.js";
import { linkTo } from "./share_link.js";

/** @import { ExperimentPublic } from "./messages.js" */

const NAME = "tour";
const KEY = "pftrack-tour";

/**
 * The address of the tour: a session of the first preset that has one; null where there is none.
 *
 * @param {ExperimentPublic[]} experiments
 */
export function tourLink(experiments) {
  for (const { id, presets } of experiments) {
    const preset = presets.find(({ tour }) => tour !== null);
    if (preset === undefined) continue;
    const { tracker, seed, parameters } = preset;
    const [page, recipe] = linkTo({ recipe: { experiment: id, tracker, seed, timeline: [{ frame: 0, values: parameters }] } }).split("#");
    return `${page}?${NAME}=${encodeURIComponent(preset.name)}#${recipe}`;
  }
  return null;
}

/** The preset whose tour the page's address asks for; null if it asks for none. */
export function tourOfAddress() {
  return new URLSearchParams(location.search).get(NAME);
}

/** From now on a reload shows the session without the tour. */
export function leaveAddress() {
  const address = new URL(location.href);
  address.searchParams.delete(NAME);
  history.replaceState(null, "", address);
}

/** Whether somebody has taken the tour here, or left it. */
export function isTourKnown() {
  return remembered(KEY) !== null;
}

/** @param {"done"|"left"} how It ended. */
export function rememberTour(how) {
  remember(KEY, how);
}
