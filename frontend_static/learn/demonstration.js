/** A demonstration on its page: the figure, its numbers and its controls. The server computes; this asks and shows. */

import { messageOf } from "../shared/api.js";
import { h } from "../shared/dom.js";
import { toast } from "../shared/toast.js";
import { follows } from "../lecturer/api.js";
import { lessons } from "./api.js";
import { Controls, SEED, declared, seedControl } from "./controls.js";
import { FigureView } from "../shared/figure/figure.js";
import { NewestRequest } from "../shared/newest_request.js";
import { showNumbers } from "./numbers.js";

/** @import { FigurePublic, FigureRequest, LessonDetail, VerdictPublic } from "../shared/messages.js" */
/** @import { Value } from "../shared/format.js" */
/** @import { Figure } from "../shared/figure/types.js" */

/**
 * @typedef {object} Places
 * @property {HTMLElement} show
 * @property {HTMLElement} numbers
 * @property {HTMLElement} controls
 */

/**
 * @typedef {object} Listener
 * @property {(value: number) => void} placed A prediction was placed in the figure.
 * @property {(isLost: boolean) => void} lost
 */

export class Demonstration {
  #lesson;
  #places;
  #figure;
  #controls;
  #newest;
  /** @type {Record<string, Value>} */
  #values;
  #seed;
  #isRevealed = false;
  #shown = 0;
  /** @type {string|null} */
  #follow = null;

  /**
   * @param {Places} places
   * @param {LessonDetail} lesson
   * @param {Listener} on
   * @param {AbortSignal} signal
   */
  constructor(places, lesson, on, signal) {
    const { question, declarations, defaults, random, asked, seed } = lesson;
    this.#lesson = lesson;
    this.#places = places;
    this.#values = { ...asked };
    this.#seed = seed;
    const place = h("div", { class: "lesson-figure-place", data: { part: "figure" } });
    places.show.replaceChildren(place);
    this.#figure = new FigureView(
      place,
      {
        turn: (name, value) => this.#turn(name, value, true),
        place: (_, x, y) => on.placed(question.along === "x" ? x : y),
        declared: (name) => this.#declared(name),
      },
      signal,
    );
    const turnables = [...declared(declarations, defaults), ...(random ? [seedControl] : [])];
    this.#controls = new Controls(places.controls, turnables, {
      propose: (name, value) => this.#turn(name, value, false),
      reset: (name) => this.#turn(name, name === SEED ? seed : lesson.defaults[name], false),
      ...(random && { draw: () => this.draw() }),
    });
    this.#newest = new NewestRequest((/** @type {FigureRequest} */ wanted) => this.#figureOf(wanted, signal), {
      answer: (answer, wanted, isNewest) => this.#show(answer, wanted, isNewest),
      refused: (error) => this.#refused(error),
      lost: on.lost,
    }, signal);
  }

  /** Show what does not answer the question, at the values at which it is asked. */
  veil() {
    this.#values = { ...this.#lesson.asked };
    this.#seed = this.#lesson.seed;
    this.#become(false);
    const { kind, panel, along } = this.#lesson.question;
    this.#figure.mark(null);
    this.#figure.ask(kind === "point" ? { panel, along } : null);
  }

  /**
   * Show everything.
   *
   * @param {VerdictPublic|null} verdict Null if nothing was answered.
   */
  reveal(verdict) {
    this.#figure.ask(null);
    const { kind, panel, along } = this.#lesson.question;
    const isPlaced = kind === "point" && verdict !== null;
    this.#figure.mark(isPlaced ? { panel, along, at: Number(verdict.given), exact: Number(verdict.exact) } : null);
    this.#become(true);
  }

  /**
   * What is shown to a class is computed once for all.
   *
   * @param {FigureRequest} wanted
   * @param {AbortSignal} signal
   */
  #figureOf(wanted, signal) {
    return this.#follow === null ? lessons.figure(this.#lesson.id, wanted, signal) : follows.figure(this.#follow, wanted, signal);
  }

  /** @param {string|null} follow The class that sees the figure, too. */
  followedBy(follow) {
    if (follow === this.#follow) return;
    this.#follow = follow;
    if (follow !== null) this.#ask(false);
  }

  /** Draw other random numbers. */
  draw() {
    if (this.#isRevealed && this.#lesson.random) this.#turn(SEED, this.#seed + 1, false);
  }

  /** @param {boolean} isRevealed */
  #become(isRevealed) {
    this.#isRevealed = isRevealed;
    this.#controls.lock(!isRevealed);
    this.#controls.show({ ...this.#values, [SEED]: this.#seed });
    this.#ask(false);
  }

  /**
   * @param {string} name
   * @param {Value} value
   * @param {boolean} nearest Whether it was dragged, so that a value out of bounds is no mistake.
   */
  #turn(name, value, nearest) {
    if (!this.#isRevealed) return;
    if (name === SEED) this.#seed = Number(value);
    else this.#values = { ...this.#values, [name]: value };
    this.#ask(nearest);
  }

  /** @param {boolean} nearest */
  #ask(nearest) {
    this.#newest.ask({ parameters: this.#values, seed: this.#seed, revealed: this.#isRevealed, nearest });
  }

  /**
   * @param {FigurePublic} answer
   * @param {FigureRequest} wanted
   * @param {boolean} isNewest
   */
  #show({ figure, numbers, parameters, seed }, { revealed = false }, isNewest) {
    // What was asked for before the answer to the question came shows too little, or too much.
    if (revealed !== this.#isRevealed) return;
    this.#figure.show(/** @type {Figure} */ (/** @type {unknown} */ (figure)), { locked: !revealed });
    showNumbers(this.#places.numbers, numbers);
    if (isNewest) {
      this.#values = parameters;
      this.#seed = seed;
      this.#controls.show({ ...parameters, [SEED]: seed });
    }
    this.#shown += 1;
    this.#places.show.dataset.shown = String(this.#shown);
  }

  /**
   * Say why, and go back to what is shown.
   *
   * @param {unknown} error
   */
  #refused(error) {
    toast(messageOf(error), { kind: "error" });
    this.#controls.show({ ...this.#values, [SEED]: this.#seed });
  }

  /** @param {string} name */
  #declared(name) {
    const found = this.#lesson.declarations.find((declaration) => declaration.name === name);
    return found && { title: found.title, unit: found.unit, minimum: found.minimum, maximum: found.maximum, step: found.step };
  }
}
