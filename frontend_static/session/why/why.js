/** Why the target was lost and what would have saved it, in the place of the plots. */

import { plainAxis } from "../../shared/figure/axes.js";
import { miniature } from "../../shared/figure/figure.js";
import { lineOver } from "../../shared/figure/kinds.js";
import { quantity } from "../../shared/format.js";
import { IconButton } from "../../shared/icons.js";
import { Made } from "../../shared/page.js";
import { h, html, useEffect, useRef } from "../../vendor/preact.js";
import { WhatIf } from "./what_if.js";

/** @import { Evidence, Sign } from "../../shared/messages.js" */
/** @import { Loss } from "./loss.js" */

const TABS = /** @type {const} */ ([["why", "Why?"], ["what-if", "What if…"]]);

/** @param {{loss: Loss}} props */
export function Beside({ loss }) {
  const { tab } = loss;
  const shown = tab.value;
  const root = useRef(/** @type {HTMLElement|null} */ (null));
  useEffect(() => root.current?.scrollIntoView({ block: "nearest" }), [shown]);
  if (shown === null) return null;
  const close = () => {
    // Keys keep steering the session.
    /** @type {HTMLElement|null|undefined} */ (root.current?.closest(".session-view"))?.focus({ preventScroll: true });
    tab.value = null;
  };
  const press = (/** @type {KeyboardEvent} */ event) => {
    if (event.key !== "Escape") return;
    event.stopPropagation();
    close();
  };
  const tabs = TABS.filter(([id]) => id === "why" || loss.offersChanges).map(
    ([id, title]) => html`<button type="button" aria-pressed=${String(id === shown)} onClick=${() => (tab.value = id)}>${title}</button>`,
  );
  return html`<div ref=${root} class="beside" onKeyDown=${press}>
    <header>
      <div class="choice" role="group" aria-label="About the loss">${tabs}</div>
      ${h(IconButton, { name: "close", title: "Back to the plots", run: close })}
    </header>
    ${shown === "why" ? h(Why, { loss }) : h(WhatIf, { loss })}
  </div>`;
}

/**
 * The button that asks why on a clip without a known loss; the answer then says how to mark the truth.
 *
 * @param {{loss: Loss}} props
 */
export function WhyButton({ loss }) {
  const { session, history, isReadOnly } = loss.view.store;
  if (isReadOnly || !session?.recipe.footage || history.length < 2 || loss.isLost.value) return null;
  return html`<button type="button" class="why-ask" title="Was it lost, and why? (W)" onClick=${() => loss.open()}>Why?</button>`;
}

/** @param {{loss: Loss}} props */
function Why({ loss }) {
  const { diagnosis, refusal, view } = loss;
  const told = diagnosis.value;
  const ask = () => loss.ask(view.store.known.position);
  const signs = told?.signs.map((sign) => h(Signed, { key: `${sign.title} ${sign.since}`, sign, go: () => view.steering.seek(sign.since) }));
  const words = told === null ? html`<div class="late"><div class="bone shimmer"></div></div>` : html`<p class="why-sentence">${told.sentence}</p>${signs}`;
  return html`
    <div class="why-words" role="status">${refusal.value === "" ? words : html`<p class="error">${refusal.value}</p>`}</div>
    <button type="button" class="quiet" title="Ask about the frame that is shown" onClick=${ask}>This frame</button>
  `;
}

/** @param {{sign: Sign, go: () => void}} props */
function Signed({ sign: { title, since, words, evidence }, go }) {
  return html`<section class="sign">
    <h3><span>${title}</span><button type="button" class="quiet" title="Go to where it began" onClick=${go}>Frame ${since}</button></h3>
    <p>${words}</p>
    <div class="evidences" onClick=${go}>${evidence.map((column) => h(Course, { key: column.name, column, since }))}</div>
  </section>`;
}

/**
 * A small plot of a column around the frame in which a sign began, which a line marks.
 *
 * @param {{column: Evidence, since: number}} props
 */
function Course({ column: { title, unit, first, values }, since }) {
  const known = values.filter((value) => value !== null);
  const [low, high] = [Math.min(...known), Math.max(...known)];
  const last = first + values.length - 1;
  const range = `${quantity(low, unit)} to ${quantity(high, unit)} ${unit}`.trim();
  const words = `${title}, ${range}, over frames ${first} to ${last}; frame ${since} is marked`;
  const y = values.map((value) => value ?? NaN);
  const x = values.map((_, place) => first + place);
  const traces = [
    lineOver({ x: [since, since], y: [low, high], ink: "lost", width: 1.5, dashed: true }),
    lineOver({ x, y, ink: "estimate", width: 2 }),
  ];
  const axes = { x: plainAxis({ low: first, high: Math.max(last, first + 1) }), y: plainAxis({ low, high: high > low ? high : low + 1 }) };
  const make = (/** @type {AbortSignal} */ end) => miniature({ ...axes, traces }, words, end);
  return html`<figure class="evidence" title=${words}>
    ${h(Made, { key: words, make })}
    <figcaption><span>${title}</span><span>${range}</span></figcaption>
  </figure>`;
}
