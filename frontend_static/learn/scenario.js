/** A run of an experiment in a lesson: a real session, of which only some parameters can be turned. */

import { Proposals, sendValues } from "../session/panel/proposals.js";
import { choice, numberBox } from "../session/panel/control.js";
import { mount } from "../session/mount.js";
import { OwnSession } from "../session/own_session.js";
import { fill, h } from "../shared/dom.js";
import { notice } from "../shared/notice.js";
import { Controls, SEED, declared } from "./controls.js";

/** @import { ScenarioPublic, SessionPublic } from "../shared/messages.js" */
/** @import { Value } from "../shared/format.js" */
/** @import { Mounted } from "../session/mount.js" */
/** @import { Turnable } from "./controls.js" */

/** @type {readonly import("../session/layout.js").Part[]} */
const PARTS = ["scene", "plots", "transport", "scrubber"];
const TRACKER = "tracker";
const TRACKER_HINT = "What follows the target; a change counts from the next frame.";
const SEED_HINT = "The same seed gives the same run, to the bit. A change starts the run again.";

export class ScenarioStage {
  #places;
  #known;
  /** @type {OwnSession|null} */
  #session = null;
  #end = new AbortController();
  /** @type {Mounted|null} */
  #mounted = null;
  /** @type {Controls|null} */
  #controls = null;
  /** @type {Record<string, Value>} */
  #first = {};
  #isLocked;
  #proposals;

  /**
   * @param {{show: HTMLElement, controls: HTMLElement}} places
   * @param {ScenarioPublic} scenario
   * @param {{isLocked: boolean, known?: () => void}} options Whether it waits for an answer; `known` is called when it is known
   *     which session that is.
   */
  constructor(places, scenario, { isLocked, known = () => {} }) {
    this.#places = places;
    this.#known = known;
    this.scenario = scenario;
    this.#isLocked = isLocked;
    const id = () => /** @type {Mounted} */ (this.#mounted).store.known.id;
    this.#proposals = new Proposals((values) => sendValues(id(), values), () => this.#show(), this.#end.signal);
    places.controls.hidden = true;
    if (scenario.problem === null) this.#begin();
    else fill(places.show, notice("This run is not available", scenario.problem, { label: "All lessons", href: "learn" }, { inline: true }));
  }

  /** Its session, once it is known. */
  get session() {
    return this.#mounted?.store.session?.id ?? null;
  }

  /** Let nothing be turned until the question is answered. */
  veil() {
    this.#lock(true);
  }

  /**
   * Let it be played and turned.
   *
   * @param {unknown} [verdict] The run itself shows what answers the question.
   */
  reveal(verdict) {
    void verdict;
    this.#lock(false);
  }

  /** Take it from the page, and end it on the server. */
  dispose() {
    this.#end.abort();
    this.#mounted?.dispose();
    this.#session?.end();
    fill(this.#places.show);
    fill(this.#places.controls);
  }

  #begin() {
    const { recipe, frame, layers } = this.scenario;
    const element = h("div", { class: "lesson-session", data: { part: "session" } });
    fill(this.#places.show, element);
    this.#session = new OwnSession(element, { recipe: { recipe, position: frame }, parts: PARTS, view: "flat", layers });
    this.#mounted = mount(element, { start: this.#session.start, plots: this.scenario.plots });
    this.#lock(this.#isLocked);
    const { store } = this.#mounted;
    store.on(["parameters", "tracker", "recipe", "state", "connection"], () => this.#told());
  }

  /** The session has told about itself. */
  #told() {
    const session = this.#mounted?.store.session;
    if (!session || this.#end.signal.aborted) return;
    if (this.#controls === null) {
      this.#first = inForce(session);
      this.#controls = new Controls(this.#places.controls, unlocked(session, this.scenario.unlocked), {
        propose: (name, value) => this.#proposals.propose(name, value),
        reset: (name) => this.#proposals.propose(name, this.#first[name]),
      });
      this.#lock(this.#isLocked);
      this.#known();
    }
    this.#show();
  }

  #show() {
    const session = this.#mounted?.store.session;
    if (session) this.#controls?.show(inForce(session), (name) => this.#proposals.holds(name));
    this.#places.controls.toggleAttribute("inert", !this.#mounted?.able);
  }

  /** @param {boolean} isLocked */
  #lock(isLocked) {
    this.#isLocked = isLocked;
    this.#places.show.toggleAttribute("inert", isLocked && this.#mounted !== null);
    this.#controls?.lock(isLocked);
  }
}

/**
 * @param {SessionPublic} session
 * @returns {Record<string, Value>}
 */
function inForce(session) {
  return { ...session.parameters, [TRACKER]: session.tracker, [SEED]: session.recipe.seed };
}

/**
 * The controls of what may be turned, in the order in which the lesson names them.
 *
 * @param {SessionPublic} session
 * @param {readonly string[]} names
 * @returns {Turnable[]}
 */
function unlocked(session, names) {
  const trackers = session.trackers.map(({ id, title }) => /** @type {[string, string]} */ ([id, title]));
  const all = [
    ...declared(session.declarations, session.parameters),
    { name: TRACKER, title: "Tracker", make: (/** @type {(value: Value) => void} */ propose) => choice("Tracker", TRACKER_HINT, trackers, propose) },
    { name: SEED, title: "Seed", make: (/** @type {(value: Value) => void} */ propose) => numberBox("Seed", SEED_HINT, { min: 0 }, propose) },
  ];
  return names.flatMap((name) => all.filter((each) => each.name === name));
}
