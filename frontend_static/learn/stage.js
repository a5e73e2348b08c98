/** The stage of a lesson and its controls: a figure computed by the server, or a run of an experiment, which is a real session with only
 * some parameters unlocked.
 */

import { SessionStart } from "../session/session_start.js";
import { Mounted } from "../session/mount.js";
import { Choice, DeclaredControl, NumberBox } from "../session/panel.js";
import { Proposals, sendValues } from "../session/steering.js";
import { messageOf, request } from "../shared/api.js";
import { build, IconButton, Notice, toast } from "../shared/dom.js";
import { FigureView } from "../shared/figure/figure.js";
import { Made } from "../shared/page.js";
import { NewestRequest } from "../shared/timing.js";
import { effect, h, html, signal } from "../vendor/preact.js";
import { Numbers } from "./numbers.js";

/** @import { Figure } from "../shared/figure/types.js" */
/** @import { Value } from "../shared/format.js" */
/** @import { Declaration, FigurePublic, FigureRequest, LessonDetail, Number as LessonNumber, ScenarioPublic, SessionPublic } from "../shared/messages.js" */
/** @import { VerdictPublic } from "../shared/messages.js" */
/** @import { Child, ReadonlySignal, VNode } from "../vendor/preact.js" */

/** @typedef {Record<string, Value>} Values Values by name, including the seed and the tracker. */
/** @typedef {VerdictPublic|"skipped"|"class"|null} Answer The answer to the question; null while it is asked. */

const SEED = "seed";
const TRACKER = "tracker";
const DRAW_HINT = "The same seed gives the same random numbers, to the bit.";
const RUN_HINT = "The same seed gives the same run, to the bit. A change starts the run again.";
const TRACKER_HINT = "The method that follows the target; a change takes effect from the next frame.";
/** @type {readonly import("../session/session_start.js").Part[]} */
const PARTS = ["scene", "plots", "transport", "scrubber"];

/** The shared part of both kinds, as their component draws it. */
class Shown {
  /** @type {string|null} Why the stage cannot be shown. */
  problem = null;
  /** Whether the whole stage is locked while the question is asked. */
  isCovered = false;
  /** @type {(() => void)|undefined} Draws new random numbers. */
  draw;
  /** Id of the run's session, once it is known. */
  id = signal(/** @type {string|null} */ (null));
  turnables = signal(/** @type {readonly Turnable[]} */ ([]));
  /** @type {Values} The values that a reset restores. */
  first = {};
  /** The values of the controls. */
  values = signal(/** @type {Values} */ ({}));
  numbers = signal(/** @type {LessonNumber[]} */ ([]));
  /** Number of drawn figures. */
  drawn = signal(0);
  isAble = signal(true);
  isLost = signal(false);
}

/** A demonstration: the server computes its figure; this class requests and shows it. */
export class Demonstration extends Shown {
  /** @type {Values} Values of the shown figure. */
  #shown = {};
  #lesson;
  #answer;
  #placed;
  #newest;
  /** @type {FigureView|null} */
  #figure = null;
  /** @type {string|null} */
  #follow = null;

  /**
   * @param {LessonDetail} lesson
   * @param {ReadonlySignal<Answer>} answer
   * @param {(value: number) => void} placed Called when a prediction is placed in the figure.
   */
  constructor(lesson, answer, placed) {
    super();
    const { declarations, defaults, seed, random } = lesson;
    this.#lesson = lesson;
    this.#answer = answer;
    this.#placed = placed;
    this.values.value = this.first = /** @type {Values} */ ({ ...defaults, [SEED]: seed });
    this.turnables.value = [...declared(declarations, defaults), ...(random ? [seedControl(DRAW_HINT)] : [])];
    if (random) this.draw = () => this.turn(SEED, Number(this.values.value[SEED]) + 1);
    const { signal: whole } = new AbortController();
    this.#newest = new NewestRequest((/** @type {FigureRequest} */ wanted) => this.#computed(wanted, whole), {
      answer: (found, wanted, isNewest) => this.#show(found, wanted, isNewest),
      refused: (error) => {
        toast(messageOf(error), { kind: "error" });
        this.values.value = { ...this.#shown };
      },
      lost: (isLost) => (this.isLost.value = isLost),
    }, whole);
  }

  get isRevealed() {
    return this.#answer.peek() !== null;
  }

  /** @param {AbortSignal} gone */
  make(gone) {
    const place = build("div", { class: "lesson-figure-place", data: { part: "figure" } });
    const on = {
      turn: (/** @type {string} */ name, /** @type {Value} */ value) => this.turn(name, value, true),
      place: this.#placed,
      declared: (/** @type {string} */ name) => this.#lesson.declarations.find((declaration) => declaration.name === name),
    };
    const figure = (this.#figure = new FigureView(place, on, gone));
    gone.addEventListener("abort", effect(() => this.#become(figure, this.#answer.value)));
    return place;
  }

  /**
   * @param {string} name
   * @param {Value} value
   * @param {boolean} [nearest] Whether a value out of bounds becomes the nearest allowed one, as after dragging.
   */
  turn(name, value, nearest = false) {
    if (!this.isRevealed) return;
    this.values.value = { ...this.values.value, [name]: value };
    this.#ask(nearest);
  }

  /** @param {string|null} follow The class that also sees the present figure and all later ones. */
  followedBy(follow) {
    if (follow === this.#follow) return;
    this.#follow = follow;
    if (follow !== null) this.#ask();
  }

  /** Show the question's figure at the question's values; or, after the answer, everything with the given answer.
   *
   * @param {FigureView} figure
   * @param {Answer} answer
   */
  #become(figure, answer) {
    const { asked, seed, question: { kind, panel, along } } = this.#lesson;
    const isPlaced = kind === "point" && answer !== null && typeof answer === "object";
    if (answer === null) this.values.value = this.#shown = { ...asked, [SEED]: seed };
    figure.ask(answer === null && kind === "point" ? { panel, along } : null);
    figure.mark(isPlaced ? { panel, along, at: Number(answer.given), exact: Number(answer.exact) } : null);
    this.#ask();
  }

  /** @param {boolean} [nearest] */
  #ask(nearest = false) {
    const { [SEED]: drawn, ...parameters } = this.values.peek();
    this.#newest.ask({ parameters, seed: Number(drawn), revealed: this.isRevealed, nearest });
  }

  /** A figure for a class is computed once for all.
   *
   * @param {FigureRequest} wanted
   * @param {AbortSignal} whole
   */
  #computed(wanted, whole) {
    const asked = { body: wanted, signal: whole };
    if (this.#follow === null) return request("POST lessons/{lesson}/figure", { lesson: this.#lesson.id, ...asked });
    return request("POST follows/{follow}/figure", { follow: this.#follow, ...asked });
  }

  /**
   * @param {FigurePublic} found
   * @param {FigureRequest} wanted
   * @param {boolean} isNewest
   */
  #show({ figure, numbers, parameters, seed: drawn }, { revealed = false }, isNewest) {
    // A figure requested before the question was answered shows too little, or too much.
    if (revealed !== this.isRevealed) return;
    this.#figure?.show(/** @type {Figure} */ (/** @type {unknown} */ (figure)), { locked: !revealed });
    this.numbers.value = numbers;
    this.#shown = { ...parameters, [SEED]: drawn };
    if (isNewest) this.values.value = this.#shown;
    this.drawn.value += 1;
  }
}

/** A run in a lesson. It begins and ends with its component. */
export class LessonRun extends Shown {
  /** @type {Mounted|null} */
  #mounted = null;
  /** @type {number|null} The frame to which it plays. */
  #goal = null;
  /** @type {Proposals|null} */
  #proposals = null;
  isCovered = true;

  /** @param {ScenarioPublic} scenario */
  constructor(scenario) {
    super();
    this.scenario = scenario;
    this.problem = scenario.problem;
    this.isAble.value = false;
  }

  /** @param {AbortSignal} gone */
  make(gone) {
    const { recipe, frame, layers, plots } = this.scenario;
    const place = build("div", { class: "lesson-session", data: { part: "session" } });
    const start = new SessionStart(place, { recipe: { recipe, position: frame }, isOwn: true, parts: PARTS, view: "flat", layers });
    const mounted = (this.#mounted = new Mounted(start, { plots }));
    const proposals = (this.#proposals = new Proposals((values) => sendValues(mounted.store, values), gone));
    gone.addEventListener("abort", effect(() => this.#told(mounted, proposals)));
    gone.addEventListener("abort", () => mounted.dispose());
    return place;
  }

  /**
   * @param {string} name
   * @param {Value} value
   */
  turn(name, value) {
    this.#proposals?.propose(name, value);
  }

  /** @param {number} frame Play until this frame is shown. */
  playTo(frame) {
    this.#goal = frame;
    this.#mounted?.steering.play();
  }

  /** The session is known.
   *
   * @param {Mounted} mounted
   * @param {Proposals} proposals
   */
  #told({ steering, store: { session, isSteerable } }, proposals) {
    this.isAble.value = isSteerable;
    if (session === null) return;
    const inForce = { ...session.parameters, [TRACKER]: session.tracker, [SEED]: session.recipe.seed };
    if (this.id.peek() === null) {
      this.first = inForce;
      this.turnables.value = unlocked(session, this.scenario.unlocked);
      this.id.value = session.id;
    }
    // A control in use keeps its value.
    this.values.value = { ...inForce, ...proposals.held };
    if (this.#goal === null || !session.playing || session.position < this.#goal) return;
    steering.seek(this.#goal);
    this.#goal = null;
  }
}

/**
 * The controls of the unlocked parameters, in the lesson's order.
 *
 * @param {SessionPublic} session
 * @param {readonly string[]} names
 */
function unlocked({ declarations, parameters, trackers }, names) {
  const options = trackers.map(({ id, title }) => /** @type {[string, string]} */ ([id, title]));
  /** @type {Turnable[]} */
  const all = [
    ...declared(declarations, parameters),
    { name: TRACKER, title: "Tracker", draw: (value, propose) => h(Choice, { label: "Tracker", hint: TRACKER_HINT, options, value: String(value), propose }) },
    seedControl(RUN_HINT),
  ];
  return names.flatMap((name) => all.filter((each) => each.name === name));
}

/** The figure or run, with its numbers and controls.
 *
 * @param {{stage: Demonstration|LessonRun, isLocked: boolean, notice?: Child}} props
 */
export function Stage({ stage, isLocked, notice = null }) {
  const { problem } = stage;
  const action = { label: "All lessons", href: "learn" };
  const missing = problem !== null && h(Notice, { title: "This run is not available", message: problem, action, inline: true });
  return html`
    <div class="lesson-show" data-part="show" data-shown=${stage.drawn.value} inert=${isLocked && stage.isCovered && !missing}>
      ${missing || h(Made, { make: (gone) => stage.make(gone) })}
    </div>
    ${notice}
    <div class="lesson-numbers" data-part="numbers">${h(Numbers, { numbers: stage.numbers.value })}</div>
    ${h(Controls, { stage, isLocked })}
  `;
}

/** One control of the stage.
 *
 * @typedef {object} Turnable
 * @property {string} name
 * @property {string} title
 * @property {(value: Value, propose: (value: Value) => void) => VNode} draw
 */

/**
 * The controls of declared parameters, in order.
 *
 * @param {readonly Declaration[]} declarations
 * @param {Values} values Current values; a parameter without one has no control.
 * @returns {Turnable[]}
 */
function declared(declarations, values) {
  const known = declarations.filter(({ name }) => name in values);
  return known.map((each) => ({ name: each.name, title: each.title, draw: (value, propose) => h(DeclaredControl, { declaration: each, value, propose }) }));
}

/**
 * @param {string} hint
 * @returns {Turnable}
 */
function seedControl(hint) {
  const draw = (/** @type {Value} */ value, /** @type {(value: Value) => void} */ propose) =>
    h(NumberBox, { label: "Seed", hint, min: 0, step: 1, value: Number(value), propose });
  return { name: SEED, title: "Seed", draw };
}

/** The controls, each with a button that restores its value.
 *
 * @param {{stage: Demonstration|LessonRun, isLocked: boolean}} props `isLocked` while the question waits for an answer.
 */
function Controls({ stage, isLocked }) {
  const { draw: again } = stage;
  const [turnables, values] = [stage.turnables.value, stage.values.value];
  const control = (/** @type {Turnable} */ { name, title, draw }) => html`<div key=${name} class="lesson-control" data-control=${name}>
    ${draw(values[name], (value) => stage.turn(name, value))}
    ${h(IconButton, { name: "replay", title: `Reset ${title}`, run: () => stage.turn(name, stage.first[name]) })}
  </div>`;
  return html`<div class="lesson-controls" data-part="controls" inert=${!stage.isAble.value} hidden=${turnables.length === 0 && !again}>
    <fieldset class="lesson-fields" aria-label="Controls" disabled=${isLocked}>
      ${turnables.map(control)}
      ${again && html`<button type="button" title="New random numbers (D)" data-role="draw" onClick=${again}>New draw</button>`}
    </fieldset>
  </div>`;
}
