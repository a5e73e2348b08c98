/**
 * What the page knows of its session, and the one place where the stream's messages change it.
 *
 * The server decides everything; this is its latest word. Answers of REST are not taken over: they may be older than what
 * the stream has already brought. Views subscribe to topics and look at the fields they draw:
 * `session`, `position`, `history`, `branches`, `bookmarks`, `connection`, `refused`.
 */

import { api } from "../shared/api.js";
import { History } from "./history.js";

export class Store {
  /** The session as the server describes it, or null before the first `hello`. */
  session = null;
  /** "connecting" | "open" | "lost" | "gone" */
  connection = "connecting";
  /** Branch id -> History. */
  histories = new Map();
  #listeners = new Map();
  #fetching = new Set();

  /** Call `listener` after each change of any of the topics. */
  on(topics, listener) {
    for (const topic of topics.split(" ")) {
      if (!this.#listeners.has(topic)) this.#listeners.set(topic, new Set());
      this.#listeners.get(topic).add(listener);
    }
  }

  /** History of the active branch. */
  get history() {
    return this.historyOf(this.session?.branch);
  }

  /** History of any branch; empty until it is known. */
  historyOf(branch) {
    if (!this.histories.has(branch)) this.histories.set(branch, new History());
    return this.histories.get(branch);
  }

  /** The active branch first, then the others. */
  get branches() {
    const all = this.session?.branches ?? [];
    return [...all].sort((a, b) => (b.id === this.session.branch) - (a.id === this.session.branch));
  }

  get activeBranch() {
    return this.session?.branches?.find((branch) => branch.id === this.session.branch);
  }

  /** Whether there is a session that listens. */
  get isAwake() {
    return this.session !== null && !["starting", "suspended", "crashed"].includes(this.session.state);
  }

  /** Have the views of a topic drawn again, since something that they show beside the session has changed. */
  touch(topic) {
    if (this.session !== null) this.#tell(topic);
  }

  /** Take over a message of the stream. */
  receive(message) {
    if (message.type === "hello") {
      this.connection = "open";
      this.session = message.session;
      this.historyOf(message.session.branch).replace(message.diagnostics ?? {});
      for (const branch of message.session.branches ?? []) {
        if (branch.id !== message.session.branch) this.#fetch(branch.id);
      }
      this.#tell("connection", "session", "position", "branches", "bookmarks", "history");
      return;
    }
    if (this.session === null) return;
    this.#handlers[message.type]?.(message);
  }

  /** Show a speed that was asked for, until the server says otherwise. */
  setSpeed(speed) {
    this.session.speed = speed;
    this.#tell("position");
  }

  setConnection(connection) {
    this.connection = connection;
    this.#tell("connection");
  }

  #handlers = {
    frame: ({ branch, diagnostics }) => this.#rows(branch, [diagnostics]),
    frames: ({ branch, rows }) => this.#rows(branch, rows),
    position: ({ branch, frame, head, playing, speed }) => {
      Object.assign(this.session, { position: frame, head, playing, speed });
      if (branch !== undefined) this.#activate(branch);
      this.#tell("position");
    },
    parameters: ({ branch, frame, parameters, tracker, values }) => {
      Object.assign(this.session, { parameters, tracker });
      if (branch !== undefined) this.#activate(branch);
      // The echo says what changed, not what the timeline is now (a restart begins a fresh one): ask for the rest.
      const timeline = (this.session.timeline ?? []).filter((change) => change.frame !== frame);
      const together = (this.session.timeline ?? []).find((change) => change.frame === frame)?.values ?? {};
      this.session.timeline = [...timeline, { frame, values: { ...together, ...values } }];
      this.#tell("session");
      this.#refresh();
    },
    branches: ({ branch, branches }) => {
      this.session.branches = branches;
      for (const { id, parent, frame } of branches) {
        if (this.historyOf(id).length === 0 && parent) this.historyOf(id).share(this.historyOf(parent), frame);
      }
      if (branch !== undefined) this.#activate(branch);
      this.#tell("branches");
      this.#refresh();
    },
    bookmarks: ({ bookmarks }) => {
      this.session.bookmarks = bookmarks;
      this.#tell("bookmarks");
    },
    session: ({ state, message }) => {
      Object.assign(this.session, { state, message });
      if (state !== "playing") this.session.playing = false;
      this.#tell("session", "position");
    },
    refused: (message) => this.#tell("refused", message),
  };

  #rows(branch, rows) {
    const history = this.historyOf(branch);
    let whole = true;
    for (const row of rows) whole = history.add(row) && whole;
    if (!whole) this.#fetch(branch);
    this.#tell("history");
  }

  #activate(branch) {
    if (this.session.branch === branch) return;
    this.session.branch = branch;
    this.#fetch(branch);
    this.#tell("branches");
  }

  async #fetch(branch) {
    if (this.#fetching.has(branch)) return;
    this.#fetching.add(branch);
    try {
      const { columns } = await api.diagnostics(this.session.id, branch);
      this.historyOf(branch).merge(columns);
      this.#tell("history");
    } catch {
      // The next hello brings it.
    } finally {
      this.#fetching.delete(branch);
    }
  }

  #refreshing = 0;

  #refresh() {
    clearTimeout(this.#refreshing);
    this.#refreshing = setTimeout(async () => {
      try {
        const { timeline, branches, bookmarks } = await api.session(this.session.id);
        Object.assign(this.session, { timeline, branches, bookmarks });
        this.#tell("session", "branches", "bookmarks");
      } catch {
        // The next hello brings it.
      }
    }, 120);
  }

  #tell(...items) {
    const detail = typeof items.at(-1) === "string" ? undefined : items.pop();
    for (const topic of items) for (const listener of this.#listeners.get(topic) ?? []) listener(detail);
  }
}
