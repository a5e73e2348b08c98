/**
 * The guided tour of a session: from play to a loss to its reason. Each step ends when the run has come so far, however
 * long that takes, and a page that is opened again goes on with the step that the run is at.
 */

import { api } from "../../shared/api.js";
import { dialogIsOpen } from "../../shared/dialog.js";
import { h } from "../../shared/dom.js";
import { icon } from "../../shared/icons.js";
import { leaveAddress, rememberTour } from "../../shared/tour_link.js";
import { Callout } from "./callout.js";

/** @import { Child } from "../../shared/elements.js" */
/** @import { Preset } from "../../shared/messages.js" */
/** @import { Mounted } from "../mount.js" */

/** @typedef {NonNullable<Preset["tour"]>} Tour */

/** The loss is let go on for so many frames, so that it is seen. */
const SEEN_FRAMES = 10;
/** Slow enough for eyes that do not know yet where to look. */
const SPEED = 0.25;

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
  await until(view, () => view.able, end.signal);
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
  const { presets } = await api.experiment(experiment);
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
  const callout = new Callout(signal, () => document.querySelector(".session-view .flat-canvas") ?? document.querySelector(".session-view .scene"));
  const way = h("button", { type: "button", class: "quiet leave", title: "Leave the tour (escape)", on: { click: () => leave("left") } }, "Leave the tour");
  const step = (/** @type {number} */ number) => h("span", { class: "step" }, `Step ${number} of 3`);
  const come = (/** @type {() => unknown} */ holds) => until(view, holds, signal);
  const lostSince = () => store.history.at(store.known.position)?.lost_since ?? null;

  if (store.known.position === 0 && !store.known.playing) {
    const slow = steering.speeds.filter((speed) => speed > 0 && speed <= SPEED).at(-1);
    if (slow !== undefined) await steering.setSpeed(slow);
    const words = [h("p", {}, tour.begin), h("p", {}, "Press ", h("strong", {}, "Play"), ", and watch the points.")];
    callout.show(seen(".play"), "A tracker at work", words, [step(1), way]);
    await come(() => store.known.playing || store.known.position > 0);
  }

  const isLost = () => lostSince() !== null && store.known.position >= Number(lostSince()) + SEEN_FRAMES;
  if (!isLost()) {
    const words = `Watch the ${store.known.target}, and the points. This box says how the tracker does; the run stops when something has happened.`;
    callout.show(seen(".verdict"), "It runs", [h("p", {}, words)], [step(2), way], { takesFocus: false });
  }
  await come(() => isLost() || steering.isAtEnd);
  await steering.pause();
  const since = lostSince();
  if (since === null) {
    const again = h("button", { type: "button", class: "primary", on: { click: () => leave("done") } }, "Finish");
    callout.show(seen(".verdict"), "Not lost this time", [h("p", {}, "With other parameters or another seed the tracker may keep its target.")], [again]);
    return;
  }

  const target = store.known.target;
  const words = [`The tracker has lost the ${target} in frame ${since}. Press `, h("strong", {}, "Before the loss"), " to go back to the moment before it."];
  callout.show(seen(".before-loss"), "Lost", [h("p", {}, words)], [step(2), way]);
  await come(() => store.known.position < since);

  callout.show(seen(`.plots [data-panel="${CSS.escape(tour.plot)}"]`), "Why", [h("p", {}, tour.reason), onward(tour.frame, steering)], [
    step(3),
    h("button", { type: "button", class: "primary", on: { click: () => leave("done") } }, icon("check"), "Finish"),
  ]);
}

/**
 * What to do next.
 *
 * @param {number} frame In which the reason is to be seen.
 * @param {import("../steering.js").Steering} steering
 */
function onward(frame, steering) {
  /** @type {Child[]} */
  const ways = [h("a", { href: "learn" }, "how particle filters work"), " or ", h("a", { href: "failures" }, "other ways to fail")];
  const there = h("button", { type: "button", on: { click: () => steering.seek(frame) } }, `Go to frame ${frame}`);
  return h("p", {}, there, " or step forward with ", h("kbd", {}, "→"), ", and watch it happen. Then see ", ways, ".");
}

/**
 * Something of the page, or the scrubber, which is always there, where that is not shown.
 *
 * @param {string} selector
 * @returns {HTMLElement}
 */
function seen(selector) {
  const candidates = [...document.querySelectorAll(`.session-view ${selector}`), ...document.querySelectorAll(".scrubber")];
  const found = candidates.find((each) => each instanceof HTMLElement && each.getClientRects().length > 0);
  return found instanceof HTMLElement ? found : document.body;
}

/**
 * Resolves as soon as something holds of a session that listens; never after the signal.
 *
 * @param {Mounted} view
 * @param {() => unknown} holds
 * @param {AbortSignal} signal
 * @returns {Promise<void>}
 */
function until(view, holds, signal) {
  return new Promise((resolve) => {
    let isDone = false;
    const look = () => {
      if (isDone || signal.aborted || view.store.session === null || !holds()) return;
      isDone = true;
      resolve();
    };
    view.store.on(["position", "playing", "history", "connection"], look);
    look();
  });
}
