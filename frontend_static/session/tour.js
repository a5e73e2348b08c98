/**
 * The guided tour of a session: from play to a loss to its reason. Each step ends when the run has come so far, however
 * long that takes, and a page that is opened again goes on with the step that the run is at.
 *
 * A note points at one thing of the page. It lies over everything and stands, for the keyboard, right before what it
 * points at, so that the next stop of the tab key is the thing to press.
 */

import { request } from "../shared/api.js";
import { dialogIsOpen } from "../shared/dialog.js";
import { build, fill, icon } from "../shared/dom.js";
import { leaveAddress, rememberTour } from "../shared/page.js";
import { after, until } from "../shared/timing.js";

/** @import { Child } from "../shared/elements.js" */
/** @import { Preset } from "../shared/messages.js" */
/** @import { Mounted } from "./mount.js" */

/** @typedef {NonNullable<Preset["tour"]>} Tour */

const TITLE = "callout-title";
const WORDS = "callout-words";
/** So long a step waits for what it points at to come into sight: what is said of a loss may take a while. */
const PATIENCE_MS = 30_000;
const SOON_MS = 50;

/** The loss is let go on for so many frames, so that it is seen. */
const SEEN_FRAMES = 10;

/** A note beside what it points at (`.pointed-at` of the style sheet is its anchor). */
class Callout {
  #element = build("div", { class: "callout", role: "dialog", popover: "manual", tabindex: -1, "aria-labelledby": TITLE, "aria-describedby": WORDS });
  #target = document.body;
  #signal;

  /** @param {AbortSignal} signal Ends it. */
  constructor(signal) {
    this.#signal = signal;
    signal.addEventListener("abort", () => {
      this.#target.classList.remove("pointed-at");
      this.#element.remove();
    });
  }

  /**
   * Stand beside something as soon as it can be seen.
   *
   * @param {string} selector What it points at; the scrubber, which is always there, where that does not come.
   * @param {string} title
   * @param {Child[]} words
   * @param {Child[]} actions
   * @param {{takesFocus?: boolean}} [options] Whether it is read out at once, with the keyboard going on from it.
   */
  async show(selector, title, words, actions, { takesFocus = true } = {}) {
    this.#target.classList.remove("pointed-at");
    const target = (this.#target = await seen(selector, this.#signal));
    target.classList.add("pointed-at");
    target.scrollIntoView({ block: "nearest", inline: "nearest" });
    fill(this.#element, build("h2", { id: TITLE }, title), build("div", { id: WORDS, class: "callout-words" }, words), build("footer", {}, actions));
    if (this.#element.nextElementSibling !== target) target.before(this.#element);
    this.#element.showPopover();
    if (takesFocus) this.#element.focus({ preventScroll: true });
  }
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
    /** @type {HTMLElement|null} */ (document.querySelector(".session-view"))?.focus({ preventScroll: true });
  };
  document.addEventListener("keydown", (event) => {
    if (event.key === "Escape" && !dialogIsOpen() && !event.defaultPrevented) leave("left");
  }, { signal: end.signal });
  await until(() => view.able, end.signal);
  const tour = await tourOf(view.store.known.recipe.experiment, name);
  if (end.signal.aborted) return;
  if (tour === null) leaveAddress();
  else await lead(view, tour, end.signal, leave);
}

/**
 * @param {string} experiment
 * @param {string} name
 * @returns {Promise<Tour|null>}
 */
async function tourOf(experiment, name) {
  const { presets } = await request("GET experiments/{experiment}", { experiment });
  return presets.find((preset) => preset.name === name)?.tour ?? null;
}

/**
 * @param {Mounted} view
 * @param {Tour} tour
 * @param {AbortSignal} signal Ends it.
 * @param {(how: "done"|"left") => void} leave
 */
async function lead(view, tour, signal, leave) {
  const { store, steering } = view;
  const callout = new Callout(signal);
  const way = build("button", { type: "button", class: "quiet leave", title: "Leave the tour (escape)", on: { click: () => leave("left") } }, "Leave the tour");
  const step = (/** @type {number} */ number) => build("span", { class: "step" }, `Step ${number} of 3`);
  const come = (/** @type {() => unknown} */ holds) => until(holds, signal);
  const lostSince = () => store.history.at(store.known.position)?.lost_since ?? null;

  if (store.known.position === 0 && !store.known.playing) {
    await steering.slowDown();
    const words = [build("p", {}, tour.begin), build("p", {}, "Press ", build("strong", {}, "Play"), ", and watch the points.")];
    await callout.show(".play", "A tracker at work", words, [step(1), way]);
    await come(() => store.known.playing || store.known.position > 0);
  }

  const isLost = () => lostSince() !== null && store.known.position >= Number(lostSince()) + SEEN_FRAMES;
  if (!isLost()) {
    const words = `Watch the ${store.known.target}, and the points. These words say how the tracker does; the run stops when something has happened.`;
    await callout.show(".verdict", "It runs", [build("p", {}, words)], [step(2), way], { takesFocus: false });
  }
  await come(() => isLost() || steering.isAtEnd);
  await steering.pause();
  const since = lostSince();
  if (since === null) {
    const again = build("button", { type: "button", class: "primary", on: { click: () => leave("done") } }, "Finish");
    await callout.show(".verdict", "Not lost this time", [build("p", {}, "With other parameters or another seed the tracker may keep its target.")], [again]);
    return;
  }

  const words = [
    build("p", {}, `The tracker has lost the ${store.known.target} in frame ${since}. This card says why, and what would have saved it.`),
    build("p", {}, "Press ", build("strong", {}, "Go to frame"), ` in it, to go back to where the tracker still holds the ${store.known.target}.`),
  ];
  await callout.show(".lost-card", "Lost", words, [step(2), way]);
  await come(() => store.known.position < since);

  const plot = `.plots [data-panel="${CSS.escape(tour.plot)}"]`;
  // It may be among those that are folded.
  if (document.querySelector(plot) === null) /** @type {HTMLElement|null} */ (document.querySelector(".side-folds button"))?.click();
  await callout.show(plot, "Why", [build("p", {}, tour.reason), onward(tour.frame, steering)], [
    step(3),
    build("button", { type: "button", class: "primary", on: { click: () => leave("done") } }, icon("check"), "Finish"),
  ]);
}

/**
 * What to do next.
 *
 * @param {number} frame In which the reason is to be seen.
 * @param {import("./steering.js").Steering} steering
 */
function onward(frame, steering) {
  /** @type {Child[]} */
  const ways = [build("a", { href: "learn" }, "how particle filters work"), " or ", build("a", { href: "failures" }, "other ways to fail")];
  const there = build("button", { type: "button", on: { click: () => steering.seek(frame) } }, `Go to frame ${frame}`);
  return build("p", {}, there, " or step forward with ", build("kbd", {}, "→"), ", and watch it happen. Then see ", ways, ".");
}

/**
 * Something of the page as soon as it can be seen, or the scrubber, which is always there.
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
