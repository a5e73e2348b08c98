/** What a person can do to a session: move through its run, by buttons, keys and the scrubber, and all else. */

import { addressOf, request, sendCommand } from "../shared/api.js";
import { attempt, toast } from "../shared/dom.js";
import { parameterValue } from "../shared/format.js";
import { follow, later, NewestRequest } from "../shared/timing.js";
import { signal as newSignal } from "../vendor/preact.js";
import { eventFramesOf } from "./readings.js";

/** @import { Value } from "../shared/format.js" */
/** @import { Command, MakeBranch } from "../shared/messages.js" */

// Reading a timeline of parameter changes: what a change did, in words.

/**
 * @typedef {import("../shared/messages.js").SessionPublic} SessionPublic
 * @typedef {{frame: number, lines: string[]}} Mark
 */

/**
 * Changes as diamonds: one for each frame after the start in which something changes beside what is drawn.
 *
 * @param {SessionPublic} session
 * @returns {Mark[]}
 */
export function marks(session) {
  const isDrawn = (/** @type {string} */ name) => session.declarations.some((each) => each.name === name && each.role === "drawing");
  return session.timeline
    .filter(({ frame, values, moved }) => frame > 0 && (moved.length > 0 || !Object.keys(values).every(isDrawn)))
    .map(({ frame, values, before, moved }) => {
      const lines = trackerFirst(values).map(([name, value]) => {
        const what = done(session, name, value);
        if (what !== null) return what;
        const [title, old, now] = inWords(session, name, before[name], value);
        return old === null || old === now ? `${title} ${now}` : `${title} ${old} → ${now}`;
      });
      return { frame, lines: [...lines, ...moved] };
    });
}

/**
 * What was done, where the value says nothing to a person: the text of a file.
 *
 * @param {SessionPublic} session
 * @param {string} name
 * @param {Value} value
 */
function done(session, name, value) {
  const declaration = session.declarations.find((candidate) => candidate.name === name);
  if (declaration?.kind === "file") return value === "" ? `${declaration.title}: none` : declaration.title;
  return null;
}

/** @param {Record<string, Value>} values */
function trackerFirst(values) {
  return Object.entries(values).sort(([a], [b]) => Number(b === "tracker") - Number(a === "tracker"));
}

/**
 * @param {SessionPublic} session
 * @param {string} name
 * @param {Value|undefined} before
 * @param {Value} after
 * @returns {[string, string|null, string]} Title, old value and new one.
 */
function inWords(session, name, before, after) {
  if (name === "tracker") return ["Tracker", before === undefined ? null : trackerTitle(session, String(before)), trackerTitle(session, String(after))];
  const declaration = session.declarations.find((candidate) => candidate.name === name);
  const old = before === undefined ? null : parameterValue(before, null);
  return [declaration?.title ?? name, old, parameterValue(after, declaration)];
}

/**
 * What tells a session from others: its name, its tracker, its seed.
 *
 * @param {SessionPublic} session
 */
export function sessionTitle(session) {
  return `${session.name} · ${trackerTitle(session, session.tracker)} · seed ${session.recipe.seed}`;
}

/**
 * The heading of a session's page: the experiment, and the clip, the preset or the name that a person gave.
 *
 * @param {SessionPublic} session
 */
export function headingOf({ title, name }) {
  return name === "" || name === title ? title : `${title} · ${name}`;
}

/**
 * A tracker's name as people know it.
 *
 * @param {{trackers: {id: string, title: string}[]}} session
 * @param {string|undefined} id
 */
export function trackerTitle(session, id) {
  return session.trackers.find((tracker) => tracker.id === id)?.title ?? id ?? "–";
}

/** The position mostly comes before the answer to the request for it, sometimes a little after it. */
const GOAL_MS = 1000;
const SLOW = 0.25;

export class Steering {
  #store;
  #signal;
  #seeking;
  /** The frame that was asked for and is not shown yet; keys that come meanwhile count from there. */
  goal = newSignal(/** @type {number|null} */ (null));
  #forget = () => {};

  /**
   * @param {import("./store.js").Store} store
   * @param {AbortSignal} signal
   */
  constructor(store, signal) {
    this.#store = store;
    this.#signal = signal;
    this.#seeking = new NewestRequest((/** @type {number} */ frame) => this.#send({ kind: "seek", frame }), {}, signal);
    const arrive = () => {
      if (store.session?.position === this.goal.value) this.goal.value = null;
    };
    follow(() => store.session?.position, arrive, signal);
  }

  get #session() {
    return this.#store.session;
  }

  /** Whether there is a session that listens. */
  get #able() {
    return this.#store.isSteerable && !this.#signal.aborted;
  }

  get isPlaying() {
    return this.#session?.playing ?? false;
  }

  /** Whether the last frame is shown, so that playing means playing again. */
  get isAtEnd() {
    return this.#session !== null && this.#session.position >= this.#session.frames - 1;
  }

  /** The speeds that are offered, times real time; 0 is as fast as possible. */
  get speeds() {
    return this.#session?.speeds ?? [];
  }

  get speed() {
    return this.#session?.speed ?? 1;
  }

  async toggle() {
    await this.#send({ kind: this.isPlaying ? "pause" : "play" });
  }

  /** Play from here; nothing happens at the end. */
  async play() {
    if (!this.isPlaying && !this.isAtEnd) await this.#send({ kind: "play" });
  }

  async pause() {
    if (this.isPlaying) await this.#send({ kind: "pause" });
  }

  /**
   * One frame on or back.
   *
   * @param {number} direction
   */
  async step(direction) {
    if (!this.#able) return;
    if (direction > 0 ? !this.isAtEnd : this.#store.known.position > 0) await this.#send({ kind: direction > 0 ? "step" : "back" });
  }

  /**
   * Go to a frame and stay there. While one seek is under way only the newest request is kept.
   *
   * @param {number} frame
   */
  async seek(frame) {
    if (!this.#able) return;
    const goal = Math.min(Math.max(0, Math.round(frame)), this.#store.known.frames - 1);
    this.#forget();
    this.goal.value = goal === this.#store.known.position ? null : goal;
    await this.pause();
    await this.#seeking.ask(goal);
    this.#forget();
    this.#forget = later(() => (this.goal.value = null), GOAL_MS, this.#signal);
  }

  /** @param {number} frames */
  async jump(frames) {
    if (this.#able) await this.seek((this.goal.peek() ?? this.#store.known.position) + frames);
  }

  async first() {
    await this.seek(0);
  }

  /** The newest frame that has been computed; computing all the rest could take long. */
  async newest() {
    if (this.#able) await this.seek(this.#store.known.computed);
  }

  async beforeLoss() {
    await this.#send({ kind: "before_loss" });
  }

  /**
   * Go to the nearest frame in which something has happened, of those that were computed.
   *
   * @param {number} direction 1 for a later one, -1 for an earlier one.
   */
  async event(direction) {
    if (!this.#able) return;
    const from = this.goal.peek() ?? this.#store.known.position;
    const frames = this.eventFrames().filter((frame) => (frame - from) * direction > 0);
    const goal = direction > 0 ? frames[0] : frames.at(-1);
    if (goal === undefined) toast(`No event ${direction > 0 ? "after" : "before"} this frame`);
    else await this.seek(goal);
  }

  /** @returns {number[]} The frames in which something has happened, in rising order. */
  eventFrames() {
    return eventFramesOf(this.#store);
  }

  /** @param {number} value */
  async setSpeed(value) {
    if (!this.#able) return;
    const before = this.speed;
    // Shown until the server says otherwise.
    this.#store.known.speed = value;
    const accepted = await this.#send({ kind: "speed", speed: value });
    if (accepted === undefined && this.speed === value) this.#store.known.speed = before;
  }

  /** Play slowly enough for eyes that do not know yet where to look. */
  async slowDown() {
    const slow = this.speeds.filter((speed) => speed > 0 && speed <= SLOW).at(-1);
    if (slow !== undefined) await this.setSpeed(slow);
  }

  /**
   * Stop playing where the target is lost with this probability; null to go on whatever it is.
   *
   * @param {number|null} probability
   */
  async stopAt(probability) {
    await this.#send({ kind: "stop_at", probability });
  }

  /** @param {number} direction */
  async faster(direction) {
    if (!this.#able) return;
    const now = this.speed === 0 ? Infinity : this.speed;
    const rank = this.speeds.map((speed) => (speed === 0 ? Infinity : speed));
    const next = direction > 0 ? rank.find((speed) => speed > now) : rank.findLast((speed) => speed < now);
    if (next !== undefined) await this.setSpeed(next === Infinity ? 0 : next);
  }

  /** @param {Command} command Asked for if there is a session that listens. */
  async #send(command) {
    return this.#able ? attempt(() => sendCommand(this.#store.known.id, command)) : undefined;
  }
}

export class Commands {
  #store;

  /** @param {import("./store.js").Store} store */
  constructor(store) {
    this.#store = store;
  }

  get #session() {
    return this.#store.known;
  }

  async bookmark(note = "") {
    if (!this.#store.isSteerable) return;
    const { position } = this.#session;
    await attempt(async () => {
      await request("POST sessions/{session}/bookmarks", { session: this.#session.id, body: { note } });
      toast(`Bookmarked frame ${position}`);
    });
  }

  /**
   * Leave the past for a new branch.
   *
   * @param {Omit<MakeBranch, "kind">} wanted
   * @returns {Promise<boolean>} Whether that was possible.
   */
  async branch(wanted) {
    return (await this.#send({ kind: "branch", ...wanted })) !== undefined;
  }

  /** @param {string} branch */
  async activate(branch) {
    await this.#send({ kind: "activate", branch });
  }

  async resume() {
    await attempt(() => request("POST sessions/{session}/resume", { session: this.#session.id }));
  }

  /** Stay at the frame that a run has come to on its way. */
  async stop() {
    await this.#send({ kind: "pause" });
  }

  /** @param {Command} command */
  #send(command) {
    return attempt(() => sendCommand(this.#session.id, command));
  }

  async save() {
    if (this.#store.session === null) return;
    await attempt(async () => {
      const run = await request("POST runs", { body: { session: this.#session.id } });
      toast("Saved; My work lists it", { action: { label: "Download", href: addressOf("GET runs/{run}/download", { run: run.id }) } });
    });
  }
}

// What the panel proposes: the newest value of each parameter, one request at a time. Until the last of them has been answered
// and the session's own word has come, what is proposed is not torn out of the hand.

/** The session's word comes by the stream, mostly before the answer to the request, sometimes a little after it. */
const REST_MS = 300;

/** @typedef {Record<string, Value>} Values By the names of the parameters. */

/**
 * Change values of a session; a seed among them starts the run again.
 *
 * @param {string} id
 * @param {Values} values
 * @returns {Promise<boolean>} Whether they were accepted.
 */
export async function sendValues(id, { seed, ...values }) {
  const accepted = await attempt(async () => {
    if (Object.keys(values).length > 0) await sendCommand(id, { kind: "change", values });
    if (seed !== undefined) await sendCommand(id, { kind: "restart", seed: Number(seed) });
    return true;
  });
  return accepted === true;
}

export class Proposals {
  /** @type {NewestRequest<Values, boolean>} */
  #requests;
  #end;
  #held = newSignal(/** @type {Values} */ ({}));
  #stopRest = () => {};

  /**
   * @param {(values: Values) => Promise<boolean>} send Tells whether the values were accepted.
   * @param {AbortSignal} end
   */
  constructor(send, end) {
    const join = (/** @type {Values} */ waiting, /** @type {Values} */ newer) => ({ ...waiting, ...newer });
    this.#requests = new NewestRequest(send, { answer: (isAccepted, _, isNewest) => isNewest && this.#rest(isAccepted), join }, end);
    this.#end = end;
  }

  /** What is proposed and not yet answered; components that read it follow it. */
  get held() {
    return this.#held.value;
  }

  /**
   * @param {string} name
   * @param {Value} value
   */
  propose(name, value) {
    this.#held.value = { ...this.#held.peek(), [name]: value };
    this.#stopRest();
    this.#requests.ask({ [name]: value });
  }

  /** @param {boolean} isAccepted What is refused is let go at once. */
  #rest(isAccepted) {
    const settle = () => (this.#held.value = {});
    if (isAccepted) this.#stopRest = later(settle, REST_MS, this.#end);
    else settle();
  }
}
