/**
 * What the page knows of its session, and the one place where the stream's messages change it.
 *
 * The server decides everything; this is its latest word. Answers of REST are not taken over: they may be older than what
 * the stream has already brought. Each field is a signal: a component that reads `store.session.position` is drawn again when
 * the position changes. Parts that are not components follow what they draw (`shared/effects.js`).
 */

import { api } from "../shared/api.js";
import { batch, signal } from "../vendor/preact.js";
import { History, isGone } from "./history.js";

/**
 * @typedef {import("../shared/messages.js").SessionMessage} SessionMessage
 * @typedef {import("../shared/messages.js").SessionPublic} SessionPublic
 * @typedef {import("../shared/messages.js").Bands} Bands
 * @typedef {import("./history.js").Row} Row
 */

export class Store {
  #session = signal(/** @type {SessionPublic|null} */ (null));
  #connection = signal(/** @type {"connecting"|"open"|"lost"|"gone"} */ ("connecting"));
  #ensemble = signal(/** @type {Bands|null} */ (null));
  /**
   * By branch.
   *
   * @type {Map<string, History>}
   */
  histories = new Map();
  /** The last message that refused a change from the scene's panel. */
  refused = signal(/** @type {import("../shared/messages.js").Refused|null} */ (null));
  /** @type {Set<string>} */
  #fetching = new Set();

  /** @param {{readOnly?: boolean}} [options] Whether it can be watched here and not be steered. */
  constructor({ readOnly = false } = {}) {
    this.isReadOnly = readOnly;
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

  get connection() {
    return this.#connection.value;
  }

  set connection(connection) {
    this.#connection.value = connection;
  }

  /** What runs of the same settings with other seeds do, where that was asked for. */
  get ensemble() {
    return this.#ensemble.value;
  }

  set ensemble(found) {
    this.#ensemble.value = found;
  }

  /** The session, where there must be one. */
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

  /** How many frames of each branch are known; what reads it follows their histories. */
  get lengths() {
    return this.branches.map(({ id }) => this.historyOf(id).length);
  }

  /** Whether there is a loss to go back to. */
  get knowsLoss() {
    return this.history.some(isGone);
  }

  /**
   * The losses of several runs, where this is a store of several; of one its own are shown.
   *
   * @returns {{history: History, colour: string}[]}
   */
  get losses() {
    return [];
  }

  /** The active branch first, then the others. */
  get branches() {
    const { branches = [], branch: active } = this.session ?? {};
    return [...branches].sort((a, b) => Number(b.id === active) - Number(a.id === active));
  }

  /** Whether there is a session that listens. */
  get isAwake() {
    return this.session !== null && ["ready", "playing", "ended"].includes(this.session.state);
  }

  /** Whether it can be steered from here. */
  get isSteerable() {
    return this.isAwake && !this.isReadOnly;
  }

  /**
   * Take over a message of the stream.
   *
   * @param {SessionMessage} message
   */
  receive(message) {
    if (message.type === "hello") this.#greeted(message);
    else if (this.session !== null && message.type === "changes") this.#merge(this.session, message);
    else if (this.session !== null && message.type === "refused") this.refused.value = message;
  }

  /** @param {import("../shared/messages.js").SessionHello} message */
  #greeted({ session, diagnostics }) {
    batch(() => {
      this.connection = "open";
      this.session = session;
      this.historyOf(session.branch).replace(diagnostics);
    });
    for (const { id } of session.branches) if (id !== session.branch) this.#fetch(id);
  }

  /**
   * Take over fields that have changed, and the frames that were computed.
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
      const { columns } = await api.diagnostics(this.known.id, branch);
      this.historyOf(branch).merge(columns);
    } catch {
      // The next hello brings it.
    } finally {
      this.#fetching.delete(branch);
    }
  }
}

/**
 * Give a session values, each behind a signal.
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
