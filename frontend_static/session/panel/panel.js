/**
 * The panel of a session in plain HTML: tracker, seed, the parameters that the run's preset is about, and, folded, every other
 * that the tracker reads, and what to draw.
 *
 * A control never decides. It proposes a value, the session accepts or refuses it, and the panel shows what the session
 * says.
 */

import { fill, h, setText } from "../../shared/dom.js";
import { coalesce } from "../../shared/timing.js";
import { fitDialog, fittable } from "../fit.js";
import { choice, makeControl, numberBox } from "./control.js";
import { Folds } from "./folds.js";
import { layerBoxes, layerLegend } from "./layer_list.js";
import { Proposals, sendValues } from "./proposals.js";

/** @import { Layers } from "../flat/layers.js" */
/** @import { Declaration } from "../../shared/messages.js" */
/** @import { Control } from "./control.js" */
/** @import { Value } from "../../shared/format.js" */

const TRACKER = "tracker";
const SEED = "seed";
const TRACKER_HINT = "What follows the target; a change counts from the next frame.";
const FIT_HINT = "Find the values under which what was seen is most probable, instead of tuning by eye.";
const SEED_HINT = "The same seed gives the same scene and the same run, to the bit. A change starts the run again.";

/**
 * @typedef {object} Group
 * @property {HTMLElement} element
 * @property {{control: Control, declaration: Declaration}[]} members
 */

export class Panel {
  #root;
  #store;
  #layers;
  #proposals;
  /** What the controls were made of, as JSON. */
  #declared = "";
  /** @type {Map<string, Control>} */
  #controls = new Map();
  /** @type {Group[]} */
  #groups = [];
  #legend;
  /** Says what a change does where that is more than to count from the next frame on. */
  #effect = h("p", { class: "control-effect", role: "status", hidden: true });
  #fit = h("button", { type: "button", class: "quiet", title: FIT_HINT, on: { click: () => fitDialog(this.#store) } }, "Fit to what was seen…");

  /**
   * @param {HTMLElement} root
   * @param {import("../store.js").Store} store Of a session that is known.
   * @param {Layers} layers
   * @param {AbortSignal} signal
   */
  constructor(root, store, layers, signal) {
    this.#root = root;
    this.#store = store;
    this.#layers = layers;
    this.#legend = layerLegend(layers, signal);
    this.#proposals = new Proposals((values) => sendValues(this.#session.id, values), () => this.#show(), signal);
    this.#build();
    this.#show();
    store.on(["session"], () => !signal.aborted && this.#rebuild());
    store.on(["parameters", "tracker", "recipe", "state", "connection"], () => !signal.aborted && this.#show());
    store.on(["branch_point", "position", "playing"], coalesce(() => this.#warn(), signal));
    this.#warn();
  }

  get #session() {
    return this.#store.known;
  }

  /** Offer what there is to be turned by now: a filter that was saved has other parameters. */
  #rebuild() {
    const declared = JSON.stringify([this.#session.declarations, this.#session.trackers]);
    if (declared === this.#declared) return;
    this.#controls.clear();
    this.#build();
    this.#show();
  }

  #build() {
    const session = this.#session;
    this.#declared = JSON.stringify([session.declarations, session.trackers]);
    const propose = (/** @type {string} */ name) => (/** @type {Value} */ value) => this.#proposals.propose(name, value);
    const trackers = session.trackers.map(({ id, title }) => /** @type {[string, string]} */ ([id, title]));
    this.#controls.set(TRACKER, choice("Tracker", TRACKER_HINT, trackers, propose(TRACKER)));
    this.#controls.set(SEED, numberBox("Seed", SEED_HINT, { min: 0 }, propose(SEED)));
    /** @type {Group["members"]} */
    const members = session.declarations.flatMap((declaration) => {
      const value = session.parameters[declaration.name];
      // Files are brought in by the menu of files, which both views have.
      if (value === undefined || declaration.kind === "file") return [];
      const control = makeControl(declaration, value, propose(declaration.name));
      this.#controls.set(declaration.name, control);
      return [{ control, declaration }];
    });
    const first = session.about.flatMap((name) => members.filter(({ declaration }) => declaration.name === name));
    const others = members.filter((member) => !first.includes(member));
    const folds = new Folds(session.title);
    const groups = grouped(others, folds, first.length === 0);
    this.#groups = [{ element: h("div", {}, elements(first)), members: first }, ...groups];
    const more = first.length > 0 && others.length > 0;
    fill(
      this.#root,
      h("h2", { class: "visually-hidden" }, "Parameters"),
      [TRACKER, SEED].map((name) => this.#controls.get(name)?.element),
      this.#groups[0].element,
      this.#fit,
      more ? folds.make("More parameters", elements(groups), { className: "control-group more" }) : elements(groups),
      this.#layers.declared.length > 0 && folds.make("What to draw", layerBoxes(this.#layers)),
      this.#layers.declared.length > 0 && this.#legend,
      this.#effect,
    );
  }

  /** Say that a change makes a branch, before it is made. */
  #warn() {
    const { branch_point: frame, position, frames, playing } = this.#session;
    this.#effect.hidden = frame === null || playing;
    if (frame === null) return;
    const branch = "makes a branch, with the same random numbers";
    const isAtEnd = position === frames - 1;
    setText(this.#effect, isAtEnd ? `The run has ended. A change runs it again from frame ${frame} and ${branch}.` : `A change at frame ${frame} ${branch}.`);
  }

  /** Show what is in force, except on a control that is in somebody's hand, and only what the tracker reads. */
  #show() {
    const { connection, isSteerable } = this.#store;
    const session = this.#session;
    /** @type {Record<string, Value>} */
    const inForce = { ...session.parameters, [TRACKER]: session.tracker, [SEED]: session.recipe.seed };
    for (const [name, control] of this.#controls) {
      if (!this.#proposals.holds(name) && name in inForce) control.show(inForce[name]);
    }
    for (const { element, members } of this.#groups) {
      for (const { control, declaration } of members) {
        control.element.hidden = declaration.trackers.length > 0 && !declaration.trackers.includes(session.tracker);
      }
      element.hidden = members.every(({ control }) => control.element.hidden);
    }
    this.#fit.hidden = fittable(session).length === 0;
    this.#root.toggleAttribute("inert", connection !== "open" || !isSteerable);
  }
}

/**
 * @param {Group["members"]} members
 * @param {Folds} folds
 * @param {boolean} open Whether the groups are unfolded until a person decides.
 * @returns {Group[]}
 */
function grouped(members, folds, open) {
  /** @type {Map<string, Group["members"]>} */
  const groups = new Map();
  for (const member of members) {
    const title = member.declaration.group || "Parameters";
    groups.set(title, [...(groups.get(title) ?? []), member]);
  }
  return [...groups].map(([title, within]) => {
    return { element: folds.make(title, elements(within), { open }), members: within };
  });
}

/** @param {readonly ({control: Control}|Group)[]} each */
function elements(each) {
  return each.map((one) => ("control" in one ? one.control.element : one.element));
}
