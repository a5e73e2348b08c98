/** The page's state of its session, and the one place where the stream's messages change it.
 * The server decides everything; this is its latest state. Answers of REST are not applied: they may be older than the stream's messages.
 * Each field is a signal: a component that reads `store.session.position` is drawn again when the position changes. Parts that are not
 components use `follow`. */

import { request } from "../shared/api.js";
import { batch, computed, signal } from "../vendor/preact.js";
import { eventFramesOf, finite, isKnown } from "./readings.js";

/** @import { SeriesValue } from "./readings.js" */

// The data of each frame of one branch: diagnostics in columns; row i belongs to frame i.

/** The server's data of a frame, in the form of the library's `Diagnostics`; null for unknown values.
 *
 * @typedef {object} Row
 * @property {number} frame
 * @property {(number|null)[]} estimate
 * @property {(number|null)[]} sigma
 * @property {number|null} log_evidence
 * @property {number|null} error
 * @property {boolean|null} lost
 * @property {boolean|null} hidden
 * @property {boolean|null} searching
 * @property {"truth"|"tracker"|""} lost_by Source of the verdict on loss; empty if there is none.
 * @property {number|null} lost_since Frame in which the present loss began.
 * @property {number|null} step_ms
 * @property {Record<string, SeriesValue>} series
 */

/** @typedef {(row: Row|undefined) => number|null} Curve A number of a row; null where it is not known. */

export class History {
  /** @type {Row[]} */
  #rows = [];
  #edition = signal(0);
  /** Counts every change, so that components that read rows follow them. */
  #changes = signal(0);

  /** Counts every change that is not an appended row; a plot that has seen this count only has to add the tail. */
  get edition() {
    return this.#edition.value;
  }

  /** The diagnostics of all frames, with holes where unknown. */
  get rows() {
    return this.#changes.value > 0 ? this.#rows : [];
  }

  get length() {
    return this.rows.length;
  }

  /** The diagnostics of a frame, or undefined if it has not been computed.
   *
   * @param {number} frame
   * @returns {Row|undefined}
   */
  at(frame) {
    return this.rows[frame];
  }

  /** Replace everything by the server's columns.
   *
   * @param {Record<string, unknown[]>} columns
   */
  replace(columns) {
    this.#rows = [];
    this.merge(columns);
  }

  /** Begin as a copy of another history, up to and including a frame.
   *
   * @param {History} parent
   * @param {number} frame
   */
  share(parent, frame) {
    this.#rows = parent.#rows.slice(0, frame + 1);
    this.#tell(true);
  }

  /** Fill in the server's columns; rows that arrived by the stream meanwhile stay.
   *
   * @param {Record<string, unknown[]>} columns
   */
  merge(columns) {
    const names = Object.keys(columns);
    for (let index = 0; index < (columns.frame?.length ?? 0); index += 1) {
      const row = /** @type {Row} */ (Object.fromEntries(names.map((name) => [name, columns[name][index]])));
      this.#rows[row.frame] = row;
    }
    this.#tell(true);
  }

  /** Add a row, or receive an old one again (a replay gives the same numbers).
   *
   * @param {Row} row
   * @returns {boolean} False when rows in between are missing, so that the whole history has to be fetched.
   */
  add(row) {
    const whole = row.frame <= this.#rows.length;
    const isOther = row.frame < this.#rows.length && row.estimate?.[0] !== this.#rows[row.frame]?.estimate?.[0];
    this.#rows[row.frame] = row;
    this.#tell(isOther);
    return whole;
  }

  /** @param {boolean} isOther Whether more has changed than an added row. */
  #tell(isOther) {
    this.#changes.value = this.#changes.peek() + 1;
    if (isOther) this.#edition.value = this.#edition.peek() + 1;
  }

  /**
   * Whether any frame has a known value of a series.
   *
   * @param {string} name
   */
  measures(name) {
    return this.some(({ series }) => isKnown(series?.[name]));
  }

  /**
   * Spans [first, last] of frames for which `test` holds.
   *
   * @param {(row: Row) => boolean} test
   */
  spans(test) {
    /** @type {[number, number][]} */
    const found = [];
    let first = -1;
    for (let frame = 0; frame <= this.length; frame += 1) {
      const row = this.at(frame);
      const holds = row !== undefined && test(row);
      if (holds && first < 0) first = frame;
      if (!holds && first >= 0) {
        found.push([first, frame - 1]);
        first = -1;
      }
    }
    return found;
  }

  /**
   * Whether `test` holds for any frame.
   *
   * @param {(row: Row) => boolean} test
   */
  some(test) {
    return this.rows.some(test);
  }
}

/** A run's history from one frame on; that frame counts as 0. */
export class HistoryWindow extends History {
  #whole;
  #part;

  /**
   * @param {() => History} whole The history as it is now.
   * @param {number} first The frame of it that is frame 0 here.
   */
  constructor(whole, first) {
    super();
    this.#whole = whole;
    this.#part = computed(() => whole().rows.slice(first));
  }

  get edition() {
    return this.#whole().edition;
  }

  get rows() {
    return this.#part.value;
  }
}

/**
 * The curves that every method has.
 *
 * @type {Record<"error"|"sigma", Curve>}
 */
export const curve = {
  error: (row) => finite(row?.error),
  /** A filter switches as soon as any component spreads too far, so the largest one is shown. */
  sigma: (row) => finite(Math.max(...(row?.sigma ?? []).filter((value) => value !== null))),
};

/**
 * Whether the target is lost, by truth or by the tracker.
 *
 * @param {Row|undefined} row
 */
export function isGone(row) {
  return typeof row?.lost_since === "number";
}

/**
 * @typedef {import("../shared/messages.js").SessionMessage} SessionMessage
 * @typedef {import("../shared/messages.js").SessionPublic} SessionPublic
 * @typedef {import("../shared/messages.js").Bands} Bands
 */

export class Store {
  #session = signal(/** @type {SessionPublic|null} */ (null));
  connection = signal(/** @type {"connecting"|"open"|"lost"|"gone"} */ ("connecting"));
  /** Bands of runs with other seeds, if requested. */
  ensemble = signal(/** @type {Bands|null} */ (null));
  /** Histories by branch.
   *
   * @type {Map<string, History>}
   */
  histories = new Map();
  /** @type {Set<string>} */
  #fetching = new Set();

  /** @param {{readOnly?: boolean}} [options] Whether it can only be watched here. */
  constructor({ readOnly = false } = {}) {
    this.isReadOnly = readOnly;
  }

  /** @returns {number|null} The frame before the first loss; null where only the server knows it. */
  get beforeLoss() {
    return null;
  }

  /** The frames with events, in rising order. */
  get eventFrames() {
    return eventFramesOf(this);
  }

  /** @returns {SessionPublic|null} As the server describes it; null before the first `hello`. */
  get session() {
    return this.#session.value;
  }

  /** @param {SessionPublic} values */
  set session(values) {
    const known = this.#session.peek();
    if (known === null) this.#session.value = alive(/** @type {SessionPublic} */ ({}), values);
    else batch(() => alive(known, values));
  }

  /** The session; an error if it is not loaded. */
  get known() {
    if (this.session === null) throw new Error("The session has not been loaded yet");
    return this.session;
  }

  /** History of the active branch. */
  get history() {
    return this.historyOf(this.session?.branch ?? "");
  }

  /**
   * History of any branch; empty until it is known.
   *
   * @param {string} branch
   */
  historyOf(branch) {
    const known = this.histories.get(branch) ?? new History();
    this.histories.set(branch, known);
    return known;
  }

  /** Number of known frames of each branch; readers follow the histories as signals. */
  get lengths() {
    return this.branches.map(({ id }) => this.historyOf(id).length);
  }

  /** Whether there is a loss to go back to. */
  get knowsLoss() {
    return this.history.some(isGone);
  }

  /**
   * The runs whose losses are shown.
   *
   * @returns {{history: History, colour: string}[]}
   */
  get losses() {
    return [{ history: this.history, colour: "lost" }];
  }

  /** The active branch first, then the others. */
  get branches() {
    const { branches = [], branch: active } = this.session ?? {};
    return [...branches].sort((a, b) => Number(b.id === active) - Number(a.id === active));
  }

  /** Whether its session is live. */
  get isAwake() {
    return this.session !== null && ["ready", "playing", "ended"].includes(this.session.state);
  }

  /** Whether the session can be steered from here. */
  get isSteerable() {
    return this.connection.value === "open" && this.isAwake && !this.isReadOnly;
  }

  /** Apply a message of the stream.
   *
   * @param {SessionMessage} message
   */
  receive(message) {
    if (message.type === "hello") this.#greeted(message);
    else if (this.session !== null && message.type === "changes") this.#merge(this.session, message);
  }

  /** @param {import("../shared/messages.js").SessionHello} message */
  #greeted({ session, diagnostics }) {
    batch(() => {
      this.connection.value = "open";
      this.session = session;
      this.historyOf(session.branch).replace(diagnostics);
    });
    for (const { id } of session.branches) if (id !== session.branch) this.#fetch(id);
  }

  /** Apply changed fields and new frames.
   *
   * @param {SessionPublic} session
   * @param {import("../shared/messages.js").Changes} message
   */
  #merge(session, { session: changes, rows }) {
    const added = batch(() => {
      alive(session, changes);
      for (const { id, parent, frame } of changes.branches ?? []) {
        if (this.historyOf(id).length === 0 && parent) this.historyOf(id).share(this.historyOf(parent), frame);
      }
      return rows.map((row) => this.history.add(/** @type {Row} */ (row)));
    });
    if (changes.branch !== undefined || added.includes(false)) this.#fetch(session.branch);
  }

  /** @param {string} branch */
  async #fetch(branch) {
    if (this.#fetching.has(branch)) return;
    this.#fetching.add(branch);
    try {
      const { columns } = await request("GET sessions/{session}/diagnostics", { session: this.known.id, branch });
      this.historyOf(branch).merge(columns);
    } catch {
      // The next hello contains it.
    } finally {
      this.#fetching.delete(branch);
    }
  }
}

/** Set a session's values, each behind a signal.
 *
 * @param {SessionPublic} session
 * @param {Partial<SessionPublic>} values
 */
function alive(session, values) {
  for (const [name, value] of Object.entries(values)) {
    if (Object.hasOwn(session, name)) {
      Object.assign(session, { [name]: value });
      continue;
    }
    const field = signal(value);
    const set = (/** @type {typeof value} */ next) => {
      field.value = next;
    };
    Object.defineProperty(session, name, { enumerable: true, get: () => field.value, set });
  }
  return session;
}
