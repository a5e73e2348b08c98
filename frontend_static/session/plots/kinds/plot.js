/**
 * What every kind of plot is: the words above it, and a panel of one figure over the frames, which is made anew whenever
 * something of it changes.
 */

/** @import { Plot as Declared, SessionPublic } from "../../../shared/messages.js" */
/** @import { FigureView } from "../../../shared/figure/figure.js" */
/** @import { Axis, Line, Panel, Trace } from "../../../shared/figure/traces.js" */
/** @import { Curve, History } from "../../history.js" */
/** @import { View } from "../../mount.js" */
/** @import { Store } from "../../store.js" */
/** @import { Columns } from "../branch_columns.js" */
/** @import { Shades } from "../shades.js" */

/**
 * How a plot is to look.
 *
 * @typedef {object} Look
 * @property {boolean} isSparkline Without axes.
 * @property {boolean} showsFrames Whether the numbers of the frames stand below it.
 * @property {boolean} isRoomy Whether there is room for names that are written out.
 * @property {[low: number, high: number]} frames Which frames are seen.
 */

/** @typedef {{low: number, high: number, ticks?: {at: number, text: string}[]}} Limits Of the axis upwards. */

export class Plot {
  /** How many rows it has, one above the other. */
  rows = 1;
  /** Names of rows with what they mean, where the names are short.
   *
   * @type {[name: string, words: string][]}
   */
  rowTitles = [];
  /** What is shaded behind the traces.
   *
   * @type {Shades[]}
   */
  shades = [];

  /**
   * @param {Declared} declared As the experiment declares it.
   * @param {SessionPublic} session
   */
  constructor(declared, session) {
    this.declared = declared;
    this.session = session;
    this.id = declared.id;
  }

  /**
   * Names of series of which at least one has to be measured for there to be something to draw; null if it needs none.
   *
   * @returns {string[]|null}
   */
  get needs() {
    return this.declared.series;
  }

  /**
   * Whether any branch has something to draw.
   *
   * @param {History[]} histories
   */
  isMeasured(histories) {
    const { needs } = this;
    return needs === null || histories.some((history) => needs.some((name) => history.measures(name)));
  }

  /**
   * The title.
   *
   * @param {Store} store
   * @returns {(string|Node)[]}
   */
  heading(store) {
    void store;
    return [`${this.declared.title} ${this.declared.unit}`.trim()];
  }

  /**
   * The figures of the frame that is shown.
   *
   * @param {Store} store
   * @returns {string}
   */
  reading(store) {
    void store;
    return "";
  }

  /**
   * Take what a person does in the figure, where that means something.
   *
   * @param {HTMLElement} place Of the figure.
   * @param {FigureView} figure
   * @param {View} view
   */
  listen(place, figure, view) {
    void [place, figure, view];
  }

  /**
   * What is drawn now, from the back to the front.
   *
   * @param {Store} store
   * @returns {Trace[]}
   */
  traces(store) {
    void store;
    return [];
  }

  /**
   * The limits of the axis upwards; asked for after the traces.
   *
   * @param {Store} store
   * @param {Look} look
   * @returns {Limits}
   */
  limits(store, look) {
    void [store, look];
    return { low: 0, high: 1 };
  }

  /**
   * The panel as it is now.
   *
   * @param {Store} store
   * @param {Look} look
   * @returns {Panel}
   */
  panel(store, look) {
    const [low, high] = look.frames;
    const traces = [...this.shades.map((shades) => shades.trace(store)), ...this.traces(store)];
    const { position } = store.known;
    const [x, y] = [{ low, high }, this.limits(store, look)].map((range) => axis(range, look.isSparkline));
    if (!look.showsFrames) x.ticks = [];
    traces.push({ kind: "line", title: "", name: "position", ink: "muted", width: 1, x: [position, position], y: [y.low, y.high], said: "", unit: "" });
    return { id: this.id, title: "", x, y, traces, handles: [], words: "", row: 0, share: [1, 1] };
  }

  /**
   * A line of a branch.
   *
   * @param {Omit<Line, "kind"|"title"|"said"|"unit"|"width"> & {said?: string, width?: number}} line
   * @returns {Line}
   */
  line({ said = this.declared.title, width = 1.8, ...line }) {
    return { kind: "line", title: "", said, unit: this.declared.unit, width, ...line };
  }

  /**
   * What is true, dashed.
   *
   * @param {Columns} data
   */
  truth(data) {
    return this.line({ name: `${this.id} truth`, x: data.frame, y: data.truth, ink: "truth", dashed: true, width: 1.2, said: "truth" });
  }
}

/**
 * @param {Limits} range
 * @param {boolean} hidden
 * @returns {Axis}
 */
function axis(range, hidden) {
  return { title: "", unit: "", log: false, names: [], hidden, ...range };
}

/**
 * The data of the frames from one on, a column for each function of a row.
 *
 * @param {History} history
 * @param {number} from
 * @param {Record<string, Curve>} values
 */
export function columns(history, from, values) {
  /** @type {Columns} */
  const data = { frame: [] };
  for (let frame = from; frame < history.length; frame += 1) data.frame.push(frame);
  for (const [name, value] of Object.entries(values)) data[name] = data.frame.map((frame) => value(history.at(frame)) ?? NaN);
  return data;
}
