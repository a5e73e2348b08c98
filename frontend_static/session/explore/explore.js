/**
 * What else the run might have been, above the plots: other seeds as a band behind the error, and what would have saved a
 * run that has lost its target.
 */

import { h, setText } from "../../shared/dom.js";
import { coalesce, later } from "../../shared/timing.js";
import { Exploration } from "./exploration.js";
import { WhatIf } from "./what_if.js";

/** @import { Bands, SessionPublic } from "../../shared/messages.js" */

/** A slider that is dragged changes twenty times a second. */
const SETTLE_MS = 150;
const HINT = "Forty runs of the same settings on the same scene with other random numbers: 10, 50 and 90 % of their errors behind the curve";
const TOPICS = /** @type {const} */ (["branch", "history", "position", "recipe", "restarts", "state", "connection", "timeline"]);

/**
 * @param {HTMLElement} root Of the plots; it stands above them.
 * @param {import("../mount.js").Mounted} view
 */
export function explore(root, view) {
  const seeds = new OtherSeeds(view);
  const whatIf = new WhatIf(view);
  const bar = h("div", { class: "explore", role: "group", "aria-label": "What else the run might have been" }, seeds.button, whatIf.opener, seeds.words);
  root.before(bar, whatIf.card);
  const update = coalesce(() => {
    if (view.store.session === null) return;
    // What was computed elsewhere says the same whatever one changes.
    const { tracker, trackers } = view.store.session;
    bar.hidden = !view.store.isAwake || trackers.some(({ id, replays }) => id === tracker && replays);
    seeds.update();
    whatIf.update();
  }, view.signal);
  view.store.on(TOPICS, update);
  update();
}

/** The switch, the share that holds, and what the plot of the error is told. */
class OtherSeeds {
  #view;
  #exploration;
  #of = "";
  #again = () => {};
  button = h("button", { type: "button", class: "chip", "aria-pressed": "false", title: HINT }, "Other seeds");
  words = h("output", { class: "explore-words" });

  /** @param {import("../mount.js").Mounted} view */
  constructor(view) {
    this.#view = view;
    const { store, signal } = view;
    this.#exploration = new Exploration(
      () => store.known.id,
      {
        found: ({ result, error }) => {
          if (result !== null && "holding" in result) this.#show(result);
          else if (error !== null) this.#say(error);
        },
        failed: (message) => this.#say(message),
      },
      signal,
    );
    this.button.addEventListener("click", () => this.#toggle());
  }

  get #isOn() {
    return this.button.getAttribute("aria-pressed") === "true";
  }

  /** Follow the settings, and say what is so in the frame that is shown. */
  update() {
    if (!this.#isOn) return;
    const { store } = this.#view;
    const of = settingsOf(store.known);
    if (of !== this.#of) {
      this.#of = of;
      this.#again();
      this.#again = later(() => this.#begin(), SETTLE_MS, this.#view.signal);
    }
    const { ensemble } = store;
    if (ensemble === null) return;
    const { [store.known.position]: share } = ensemble.holding;
    const { [store.known.position]: runs = 0 } = ensemble.computed;
    if (share === undefined) this.#say("not there yet");
    else if (share === null) this.#say(`${runs} runs`);
    else this.#say(`${Math.round(share * runs)} of ${runs} hold in this frame`);
  }

  #toggle() {
    const on = !this.#isOn;
    this.button.setAttribute("aria-pressed", String(on));
    this.#of = "";
    if (on) {
      this.#say("computing…");
      this.update();
    } else {
      this.#exploration.stop();
      this.#say("");
      this.#show(null);
    }
  }

  #begin() {
    if (this.#isOn) this.#exploration.begin({ kind: "ensemble" });
  }

  /** @param {Bands|null} found */
  #show(found) {
    const { store } = this.#view;
    store.ensemble = found;
    store.touch("history");
    this.update();
  }

  /** @param {string} words */
  #say(words) {
    setText(this.words, words);
  }
}

/**
 * What the runs of other seeds follow from.
 *
 * @param {SessionPublic} session
 */
function settingsOf({ branch, recipe, restarts, timeline }) {
  return JSON.stringify([branch, recipe.seed, recipe.tracker, restarts, timeline]);
}
