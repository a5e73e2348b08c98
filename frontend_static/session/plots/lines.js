/** The lines of branches in a figure. */

/** @import { BranchPublic } from "../../shared/messages.js" */
/** @import { History } from "../history.js" */
/** @import { Store } from "../store.js" */
/** @import { Glyph, Renderer, Source } from "./bokeh_api.js" */
/** @import { Figure } from "./figure.js" */

/**
 * The glyphs of a branch: those that are seen of all branches, and those of the active one alone.
 *
 * @typedef {object} Glyphs
 * @property {Renderer[]} [all] Have the branch's colour.
 * @property {Renderer[]} [active] Those tagged "branch" have the branch's colour.
 */

/** The lines of a branch, and how much of its history they show. */
class BranchLines {
  edition = -1;
  length = 0;
  low = Infinity;
  high = -Infinity;
  /** @type {boolean|null} */
  isActive = null;
  colour = "";

  /**
   * @param {Source} source
   * @param {Glyphs} glyphs
   */
  constructor(source, { all = [], active = [] }) {
    this.source = source;
    this.all = all;
    this.active = active;
  }
}

/** The lines of the branches in a figure. Of a history that has only grown the new frames alone are handed over. */
export class Lines {
  #figure;
  #columns;
  #make;
  #limits;
  /** @type {Map<string, BranchLines>} */
  #drawn = new Map();

  /**
   * @param {Figure} figure
   * @param {(history: History, from: number) => Record<string, number[]>} columns The data of the frames from one on.
   * @param {(source: Source, branch: BranchPublic) => Glyphs} make
   * @param {string[]|null} limits The columns that `most` is the largest of; all if not given.
   */
  constructor(figure, columns, make, limits = null) {
    this.#figure = figure;
    this.#columns = columns;
    this.#make = make;
    this.#limits = limits;
  }

  /** @param {Store} store */
  draw(store) {
    const { branch: active } = store.known;
    for (const branch of store.branches) this.#branch(branch, store.historyOf(branch.id), branch.id === active);
    const shown = new Set(store.branches.map(({ id }) => id));
    for (const [id, line] of this.#drawn) {
      if (!shown.has(id)) for (const glyph of [...line.all, ...line.active]) glyph.visible = false;
    }
  }

  /** The largest of what is drawn, the sign apart; 0 where there is nothing. */
  get most() {
    return Math.max(0, ...this.extent.filter(Number.isFinite).map(Math.abs));
  }

  /**
   * The smallest and the largest of what is drawn; the wrong way round where there is nothing.
   *
   * @returns {[number, number]}
   */
  get extent() {
    const drawn = [...this.#drawn.values()];
    return [Math.min(...drawn.map(({ low }) => low)), Math.max(...drawn.map(({ high }) => high))];
  }

  /** What is drawn of the active branch alone. */
  get ofActive() {
    return [...this.#drawn.values()].flatMap((line) => line.active);
  }

  /**
   * @param {BranchPublic} branch
   * @param {History} history
   * @returns {BranchLines}
   */
  #begin(branch, history) {
    const source = this.#figure.source(this.#columns(history, history.length));
    const line = new BranchLines(source, this.#make(source, branch));
    this.#drawn.set(branch.id, line);
    return line;
  }

  /**
   * @param {BranchPublic} branch
   * @param {History} history
   * @param {boolean} active
   */
  #branch(branch, history, active) {
    const line = this.#drawn.get(branch.id) ?? this.#begin(branch, history);
    // BokehJS takes every assignment for a change, and draws again.
    if (line.isActive !== active) {
      line.isActive = active;
      for (const one of line.active) one.visible = active;
      for (const one of line.all) {
        one.glyph.line_width = active ? 1.8 : 1.2;
        // The active branch lies above the others, which share its past.
        one.level = active ? "guide" : "glyph";
      }
    }
    if (line.colour !== branch.colour) {
      line.colour = branch.colour;
      for (const one of line.all) one.glyph.line_color = branch.colour;
      for (const one of line.active) if (one.tags.includes("branch")) tint(one.glyph, branch.colour);
    }
    if (!active && line.all.length === 0) return;
    this.#feed(line, history);
  }

  /**
   * @param {BranchLines} line
   * @param {History} history
   */
  #feed(line, history) {
    const whole = line.edition !== history.edition || history.length < line.length;
    if (!whole && history.length === line.length) return;
    const data = this.#columns(history, whole ? 0 : line.length);
    const [low, high] = extent(data, this.#limits);
    [line.low, line.high] = whole ? [low, high] : [Math.min(line.low, low), Math.max(line.high, high)];
    if (whole) line.source.data = data;
    else line.source.stream(data);
    [line.edition, line.length] = [history.edition, history.length];
  }
}

/**
 * The smallest and the largest number of some columns; of all but the frames if none are named.
 *
 * @param {Record<string, number[]>} data
 * @param {string[]|null} limits
 */
function extent({ frame, ...data }, limits) {
  let [low, high] = [Infinity, -Infinity];
  for (const name of limits ?? Object.keys(data)) {
    for (const value of data[name]) {
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  return [low, high];
}

/**
 * Give an area or a line its colour.
 *
 * @param {Glyph} glyph
 * @param {string} colour
 */
function tint(glyph, colour) {
  if ("fill_color" in glyph) glyph.fill_color = colour;
  else glyph.line_color = colour;
}
