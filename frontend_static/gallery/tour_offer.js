/** The offer of the guided tour: large for a first visitor, a line for everybody else. */

import { fill, h } from "../shared/dom.js";
import { isTourKnown, tourLink } from "../shared/tour_link.js";

/**
 * @param {HTMLElement} root Stays hidden where there is no tour.
 * @param {import("../shared/messages.js").ExperimentPublic[]} experiments
 */
export function offer(root, experiments) {
  const href = tourLink(experiments);
  root.hidden = href === null;
  if (href === null) return;
  const known = isTourKnown();
  root.classList.toggle("known", known);
  const data = { role: "tour" };
  if (known) {
    fill(root, h("a", { href, data }, "Take the guided tour again"));
    return;
  }
  fill(
    root,
    h("h2", {}, "New here? See a tracker lose its target, and why"),
    h("p", { class: "hint" }, "Three clicks, about a minute. You can leave the tour at any time."),
    h("footer", {}, h("a", { class: "button primary", href, data }, "Take the tour"), h("span", { class: "hint" }, "or choose an experiment below")),
  );
}
