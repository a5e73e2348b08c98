/**
 * The guided tour of a session: from play to a loss to its reason. Each step ends when the run has reached its point, without a time limit;
 * a reopened page continues with the step of the run.
 * A note points at one element of the page. It lies over everything and is, for the keyboard, right before that element, so that the next
 tab stop is the element to press. */

import { request } from "../shared/api.js";
import { dialogIsOpen } from "../shared/dialog.js";
import { build, Icon } from "../shared/dom.js";
import { leaveAddress, rememberTour } from "../shared/page.js";
import { after, until } from "../shared/timing.js";
import { h, html, render } from "../vendor/preact.js";

/** @import { Child } from "../vendor/preact.js" */
/** @import { Preset } from "../shared/messages.js" */
/** @import { Mounted } from "./mount.js" */

/** @typedef {NonNullable<Preset["tour"]>} Tour */

const TITLE = "callout-title";
const WORDS = "callout-words";
/** How long a step waits for its element to become visible: the explanation of a loss may take a while. */
const PATIENCE_MS = 30_000;
const SOON_MS = 50;

/** Frames for which a loss continues, so that it is visible. */
const SEEN_FRAMES = 10;

/** A note next to its element (`.pointed-at` of the style sheet is its anchor).
 *
 * @param {AbortSignal} signal Ends the tour.
 */
function callout(signal) {
  const element = build("div", { class: "callout", role: "dialog", popover: "manual", tabindex: -1, "aria-labelledby": TITLE, "aria-describedby": WORDS });
  let target = document.body;
  signal.addEventListener("abort", () => {
    target.classList.remove("pointed-at");
    element.remove();
  });
  /** Show the note next to an element once that is visible.
   *
   * @param {string} selector The element; if it does not appear, the scrubber, which is always there.
   * @param {string} title
   * @param {Child} words
   * @param {Child} actions
   * @param {boolean} [takesFocus] Whether it is read out at once and gets the focus.
   */
  return async (selector, title, words, actions, takesFocus = true) => {
    target.classList.remove("pointed-at");
    target = await seen(selector, signal);
    target.classList.add("pointed-at");
    target.scrollIntoView({ block: "nearest", inline: "nearest" });
    render(html`<h2 id=${TITLE}>${title}</h2><div id=${WORDS} class="callout-words">${words}</div><footer>${actions}</footer>`, element);
    if (element.nextElementSibling !== target) target.before(element);
    element.showPopover();
    if (takesFocus) element.focus({ preventScroll: true });
  };
}

/**
 * @param {Mounted} view
 * @param {string} name The preset whose tour it is.
 */
export async function guide(view, name) {
  const end = new AbortController();
  view.signal.addEventListener("abort", () => end.abort());
  const leave = (/** @type {"done"|"left"} */ how) => {
    rememberTour(how);
    leaveAddress();
    end.abort();
    /** @type {HTMLElement|null} */ (document.querySelector(".session-view .play"))?.focus({ preventScroll: true });
  };
  document.addEventListener("keydown", (event) => {
    if (event.key === "Escape" && !dialogIsOpen() && !event.defaultPrevented) leave("left");
  }, { signal: end.signal });
  await until(() => view.store.isSteerable, end.signal);
  const { presets } = await request("GET experiments/{experiment}", { experiment: view.store.known.recipe.experiment });
  const tour = presets.find((preset) => preset.name === name)?.tour;
  if (end.signal.aborted) return;
  if (tour) await lead(view, tour, end.signal, leave);
  else leaveAddress();
}

/**
 * @param {Mounted} view
 * @param {Tour} tour
 * @param {AbortSignal} signal Ends the tour.
 * @param {(how: "done"|"left") => void} leave
 */
async function lead({ store, steering }, tour, signal, leave) {
  const show = callout(signal);
  const step = (/** @type {number} */ number) => html`<span class="step">Step ${number} of 3</span>`;
  const way = html`<button type="button" class="quiet leave" title="Leave the tour (escape)" onClick=${() => leave("left")}>Leave the tour</button>`;
  const finish = html`<button type="button" class="primary" onClick=${() => leave("done")}>${h(Icon, { name: "check" })}Finish</button>`;
  const lostSince = () => store.history.at(store.known.position)?.lost_since ?? null;
  const { target } = store.known;

  if (store.known.position === 0 && !store.known.playing) {
    await steering.slowDown();
    const words = html`<p>${tour.begin}</p><p>Press <strong>Play</strong>, and watch the points.</p>`;
    await show(".play", "A tracker at work", words, [step(1), way]);
    await until(() => store.known.playing || store.known.position > 0, signal);
  }

  const isLost = () => lostSince() !== null && store.known.position >= Number(lostSince()) + SEEN_FRAMES;
  if (!isLost()) {
    const words = `Watch the ${target}, and the points. This line rates the tracker; the run stops at the next event.`;
    await show(".verdict", "It runs", html`<p>${words}</p>`, [step(2), way], false);
  }
  await until(() => isLost() || steering.isAtEnd, signal);
  await steering.pause();
  const since = lostSince();
  if (since === null) {
    await show(".verdict", "Not lost this time", html`<p>With other parameters or another seed the tracker may keep its target.</p>`, finish);
    return;
  }

  const words = html`
    <p>The tracker has lost the ${target} in frame ${since}. This card gives the cause, and changes that would have saved it.</p>
    <p>Press <strong>Go to frame</strong> in it, to go back to where the tracker still holds the ${target}.</p>
  `;
  await show(".lost-card", "Lost", words, [step(2), way]);
  await until(() => store.known.position < since, signal);

  const plot = `.plots [data-panel="${CSS.escape(tour.plot)}"]`;
  // The plot may be folded.
  if (document.querySelector(plot) === null) /** @type {HTMLElement|null} */ (document.querySelector(".side-folds button"))?.click();
  const onward = html`<p>
    <button type="button" onClick=${() => steering.seek(tour.frame)}>Go to frame ${tour.frame}</button> or step forward with <kbd>→</kbd>, and watch it
    happen. Then see <a href="learn">how particle filters work</a> or <a href="failures">other ways to fail</a>.
  </p>`;
  await show(plot, "Why", html`<p>${tour.reason}</p>${onward}`, [step(3), finish]);
}

/** An element of the page once it is visible, or the scrubber, which is always there.
 *
 * @param {string} selector
 * @param {AbortSignal} signal
 * @returns {Promise<HTMLElement>}
 */
async function seen(selector, signal) {
  const end = performance.now() + PATIENCE_MS;
  for (;;) {
    const candidates = [...document.querySelectorAll(`.session-view ${selector}`), ...(performance.now() > end ? document.querySelectorAll(".scrubber") : [])];
    const found = candidates.find((each) => each.clientHeight > 0 && each.checkVisibility({ visibilityProperty: true }));
    if (found instanceof HTMLElement) return found;
    await after(SOON_MS, signal);
  }
}
