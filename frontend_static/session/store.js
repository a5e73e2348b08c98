/**
 * What the page knows of its session, and the one place where the stream's messages change it.
 *
 * The server decides everything; this is its latest word. Answers of REST are not taken over: they may be older than what
 * the stream has already brought. Each field that moves is a topic: views subscribe to those that they draw.
 */

import { api } from "../shared/api.js";
import { Topics } from "../shared/topics.js";
import { History, isGone } from "./history.js";

/**
 * @typedef {import("../shared/messages.js").SessionMessage} SessionMessage
 * @typedef {import("../shared/messages.js").SessionPublic} SessionPublic
 * @typedef {import("../shared/messages.js").Bands} Bands
 * @typedef {import("./history.js").Row} Row
 * @typedef {import("../shared/messages.js").SessionSnapshot} SessionSnapshot
 * @typedef {keyof SessionSnapshot|"session"|"history"|"connection"|"refused"} Topic A field that moves, or "session" for all that
 *   is known of it, fixed or not.
 */

/** A picture that has not come for so long keeps nothing waiting; on a busy machine the first one of a run may take seconds. */
const PICTURE_MS = 5000;

/** @extends {Topics<Topic>} */
export class Store extends Topics {
  /**
   * The session as the server describes it, or null before the first `hello`.
   *
   * @type {SessionPublic|null}
   */
  session = null;
  /** @type {"connecting"|"open"|"lost"|"gone"} */
  connection = "connecting";
  /**
   * By branch.
   *
   * @type {Map<string, History>}
   */
  histories = new Map();
  /** Why a change that came through the scene's panel was refused, the last time that one was. */
  refusal = "";
  /**
   * What runs of the same settings with other seeds do, where that was asked for.
   *
   * @type {Bands|null}
   */
  ensemble = null;
  /** @type {Set<string>} */
  #fetching = new Set();
  /** The frame of the newest picture on the page, and when it came. */
  #picture = { frame: -1, at: -Infinity };
  /** Where the server has said that the run stands; what is shown waits for its picture. */
  #told = 0;

  /** @param {{readOnly?: boolean}} [options] Whether whoever looks on here cannot steer it. */
  constructor({ readOnly = false } = {}) {
    super();
    this.isReadOnly = readOnly;
  }

  /** The session, where there must be one: who listens to what changes in it is only called then. */
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

  get activeBranch() {
    return this.session?.branches.find((branch) => branch.id === this.session?.branch);
  }

  /** Whether there is a session that listens. */
  get isAwake() {
    return this.session !== null && ["ready", "playing", "ended"].includes(this.session.state);
  }

  /** Whether it listens to whoever looks on here. */
  get isSteerable() {
    return this.isAwake && !this.isReadOnly;
  }

  /**
   * Have the views of a topic drawn again, since something that they show beside the session has changed.
   *
   * @param {Topic} topic
   */
  touch(topic) {
    if (this.session !== null) this.tell(topic);
  }

  /**
   * Take over a message of the stream.
   *
   * @param {SessionMessage} message
   */
  receive(message) {
    if (message.type === "hello") this.#greeted(message);
    else if (this.session !== null) this.#take(this.session, message);
  }

  /**
   * Take note that the picture of a frame is painted next. While the run plays, pictures come later than numbers, and fewer of
   * them: what is said is said of the frame that is seen.
   *
   * @param {number} frame
   */
  show(frame) {
    this.#picture = { frame, at: performance.now() };
    if (this.#seePicture()) this.tell("position");
  }

  /** Whether the run plays beside pictures, which say how far it is. */
  get #followsPicture() {
    return this.known.playing && performance.now() - this.#picture.at < PICTURE_MS;
  }

  /** Stand at the frame of the picture, if it is known; returns whether that is another one than before. */
  #seePicture() {
    const { session, history } = this;
    const { frame } = this.#picture;
    if (session === null || !this.#followsPicture || session.position === frame || history.at(frame) === undefined) return false;
    session.position = frame;
    return true;
  }

  /**
   * Show a speed that was asked for, until the server says otherwise.
   *
   * @param {number} speed
   */
  setSpeed(speed) {
    this.known.speed = speed;
    this.tell("speed");
  }

  /** @param {Store["connection"]} connection */
  setConnection(connection) {
    this.connection = connection;
    this.tell("connection");
  }

  /** @param {import("../shared/messages.js").SessionHello} message */
  #greeted({ session, diagnostics }) {
    this.connection = "open";
    this.session = session;
    this.#told = session.position;
    this.historyOf(session.branch).replace(diagnostics);
    for (const { id } of session.branches) if (id !== session.branch) this.#fetch(id);
    this.tell("connection", "session", "history", .../** @type {Topic[]} */ (Object.keys(session)));
  }

  /**
   * @param {SessionPublic} session
   * @param {SessionMessage} message
   */
  #take(session, message) {
    switch (message.type) {
      case "frame":
        this.#computed(session, message.branch, [message.diagnostics]);
        break;
      case "frames":
        this.#computed(session, message.branch, message.rows);
        break;
      case "changes":
        this.#merge(session, message.session);
        break;
      case "refused":
        this.refusal = message.message;
        this.tell("refused");
        break;
      default:
        break;
    }
  }

  /**
   * Take over frames that were computed; while the run plays, the last of them is the one that is shown, or that which the
   * picture shows.
   *
   * @param {SessionPublic} session
   * @param {string} branch
   * @param {import("../shared/messages.js").Frames["rows"]} rows
   */
  #computed(session, branch, rows) {
    this.#rows(branch, rows);
    const isShown = session.playing && branch === session.branch && rows.length > 0;
    if (isShown) this.#told = session.computed = /** @type {Row} */ (rows[rows.length - 1]).frame;
    if (isShown && !this.#followsPicture) session.position = this.#told;
    this.#seePicture();
    this.tell("history", ...(isShown ? /** @type {const} */ (["position", "computed"]) : []));
  }

  /**
   * Take over fields that have changed.
   *
   * @param {SessionPublic} session
   * @param {Partial<SessionSnapshot>} changes
   */
  #merge(session, changes) {
    const { position } = session;
    Object.assign(session, changes);
    this.#told = changes.position ?? this.#told;
    // Whoever goes elsewhere, plays again or stops, stands there, whatever the picture shows still; who begins to play may be ahead.
    const playsOn = changes.playing === undefined || (changes.playing && (changes.position ?? position) >= position);
    const goesElsewhere = changes.branch !== undefined || changes.restarts !== undefined || !playsOn;
    session.position = !goesElsewhere && this.#followsPicture ? position : this.#told;
    for (const { id, parent, frame } of changes.branches ?? []) {
      if (this.historyOf(id).length === 0 && parent) this.historyOf(id).share(this.historyOf(parent), frame);
    }
    if (changes.branch !== undefined) this.#fetch(changes.branch);
    const topics = new Set(/** @type {(keyof SessionSnapshot)[]} */ (Object.keys(changes)));
    if (session.position !== position) topics.add("position");
    this.tell(...topics);
  }

  /**
   * @param {string} branch
   * @param {Record<string, unknown>[]} rows
   */
  #rows(branch, rows) {
    const history = this.historyOf(branch);
    let isWhole = true;
    for (const row of rows) isWhole = history.add(/** @type {Row} */ (row)) && isWhole;
    if (!isWhole) this.#fetch(branch);
  }

  /** @param {string} branch */
  async #fetch(branch) {
    if (this.#fetching.has(branch)) return;
    this.#fetching.add(branch);
    try {
      const { columns } = await api.diagnostics(this.known.id, branch);
      this.historyOf(branch).merge(columns);
      this.tell("history");
    } catch {
      // The next hello brings it.
    } finally {
      this.#fetching.delete(branch);
    }
  }
}
