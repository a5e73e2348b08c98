/** What the start page offers besides the experiments: the guided tour, and a filter of one's own. */

import { api } from "../shared/api.js";
import { CopyButton } from "../shared/copy.js";
import { linkTo } from "../shared/share_link.js";
import { isTourKnown, tourLink } from "../shared/tour_link.js";
import { h, html, useEffect, useSignal } from "../vendor/preact.js";

/** @import { ExperimentPublic, FilterPublic } from "../shared/messages.js" */

/** Written into the page by the server, which knows where its shell finds the program. */
const COMMANDS = document.documentElement.dataset.commands ?? "";

/**
 * The tour: large for a first visitor, a line for everybody else, nothing where there is none.
 *
 * @param {{experiments: ExperimentPublic[]}} props
 */
export function TourOffer({ experiments }) {
  const href = tourLink(experiments);
  if (href === null) return null;
  if (isTourKnown()) {
    return html`<section class="tour-offer known" aria-label="Guided tour"><a href=${href} data-role="tour">Take the guided tour again</a></section>`;
  }
  return html`<section class="tour-offer" aria-label="Guided tour">
    <h2>New here? See a tracker lose its target, and why</h2>
    <p class="hint">Three clicks, about a minute. You can leave the tour at any time.</p>
    <footer><a class="button primary" href=${href} data-role="tour">Take the tour</a><span class="hint">or choose an experiment below</span></footer>
  </section>`;
}

/** The commands by which one begins, or the files that the server was started with. */
export function OwnFilterOffer() {
  const files = useSignal(/** @type {FilterPublic[]} */ ([]));
  useEffect(() => void api.filters().then((found) => (files.value = found), () => {}), []);
  const open = (/** @type {FilterPublic} */ { name, file, experiment }) =>
    html`<a class="button primary" href=${linkTo({ recipe: { experiment, tracker: name } })}>Open ${file}</a>`;
  const begin = html`<div class="own-commands">
    <pre tabindex="0" aria-label="Commands">${COMMANDS}</pre>
    ${h(CopyButton, { label: "Copy", text: COMMANDS, what: "the commands" })}
  </div>`;
  const hasFiles = files.value.length > 0;
  return html`<section class="own-filter" aria-label="Your own filter">
    <h2>${hasFiles ? "Your filter" : "Write your own filter"}</h2>
    <p class="hint">One Python file. Save it, and the running session goes on with the new code.</p>
    ${hasFiles ? html`<footer>${files.value.map(open)}</footer>` : begin}
  </section>`;
}
