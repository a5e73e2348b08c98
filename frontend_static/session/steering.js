/** Commands to a session: moving through its run by buttons, keys and the scrubber, and all others. */

import { request, sendCommand } from "../shared/api.js";
import { attempt, toast } from "../shared/dom.js";
import { parameterValue } from "../shared/format.js";
import { follow, later, NewestRequest } from "../shared/timing.js";
import { signal as newSignal } from "../vendor/preact.js";

/** @import { Value } from "../shared/format.js" */
/** @import { Command, CommandAnswer } from "../shared/messages.js" */
/** @import { Store } from "./store.js" */

// A timeline of parameter changes in words.

/**
 * @typedef {import("../shared/messages.js").SessionPublic} SessionPublic
 * @typedef {{frame: number, lines: string[]}} Mark
 */

/** Changes as diamonds: one for each frame after the start in which more than the drawing changes.
 *
 * @param {SessionPublic} session
 * @returns {Mark[]}
 */
export function marks(session) {
  const isDrawn = (/** @type {string} */ name) => declared(session, name)?.role === "drawing";
  return session.timeline
    .filter(({ frame, values, moved }) => frame > 0 && (moved.length > 0 || !Object.keys(values).every(isDrawn)))
    .map(({ frame, values: { tracker, ...values }, before, moved }) => {
      const changed = Object.entries(tracker === undefined ? values : { tracker, ...values });
      return { frame, lines: [...changed.map(([name, value]) => inWords(session, name, before[name], value)), ...moved] };
    });
}

/** A change in words; of a file only its title, since its text is not readable.
 *
 * @param {SessionPublic} session
 * @param {string} name
 * @param {Value|undefined} before
 * @param {Value} after
 */
function inWords(session, name, before, after) {
  const declaration = declared(session, name);
  const title = name === "tracker" ? "Tracker" : (declaration?.title ?? name);
  if (declaration?.kind === "file") return after === "" ? `${title}: none` : title;
  const told = (/** @type {Value} */ value, /** @type {typeof declaration|null} */ unit) =>
    name === "tracker" ? trackerTitle(session, String(value)) : parameterValue(value, unit);
  const [old, now] = [before === undefined ? null : told(before, null), told(after, declaration)];
  return old === null || old === now ? `${title} ${now}` : `${title} ${old} → ${now}`;
}

/**
 * @param {SessionPublic} session
 * @param {string} name
 */
function declared(session, name) {
  return session.declarations.find((each) => each.name === name);
}

/** The identification of a session: its name, its tracker, its seed.
 *
 * @param {SessionPublic} session
 */
export function sessionTitle(session) {
  return `${session.name} · ${trackerTitle(session, session.tracker)} · seed ${session.recipe.seed}`;
}

/**
 * Return the plan of a sweep that repeats a run: its scene or recording, its tracker, and its first values.
 *
 * @param {SessionPublic} session
 */
export function repeated({ recipe, tracker, upload }) {
  const [first] = recipe.timeline ?? [];
  const parameters = first?.frame === 0 ? first.values : {};
  return { experiment: recipe.experiment, upload, footage: recipe.footage, trackers: [recipe.tracker ?? tracker], parameters };
}

/**
 * The heading of a session's page: the experiment, and the clip, the preset or the name that a person gave.
 *
 * @param {SessionPublic} session
 */
export function headingOf({ title, name }) {
  return name === "" || name === title ? title : `${title} · ${name}`;
}

/** A tracker's title.
 *
 * @param {{trackers: {id: string, title: string}[]}} session
 * @param {string|undefined} id
 */
export function trackerTitle(session, id) {
  return session.trackers.find((tracker) => tracker.id === id)?.title ?? id ?? "–";
}

/** Send a command to a session; show a refusal.
 *
 * @param {Pick<Store, "known">} store
 * @param {Command} command
 * @returns {Promise<CommandAnswer|undefined>} Undefined if it was refused.
 */
export function steer({ known: { id } }, command) {
  return attempt(() => sendCommand(id, command));
}

/**
 * @param {Store} store
 * @param {string} [note]
 */
export async function bookmark(store, note = "") {
  if (!store.isSteerable) return;
  await attempt(async () => {
    const { frame } = await request("POST sessions/{session}/bookmarks", { session: store.known.id, body: { note } });
    toast(`Bookmarked frame ${frame}`);
  });
}

/** Wait for the position, which arrives mostly before the answer to a seek, sometimes a little after it. */
const GOAL_MS = 1000;
const SLOW = 0.25;

export class Steering {
  #store;
  #signal;
  #seeking;
  /** The requested frame that is not shown yet. */
  goal = newSignal(/** @type {number|null} */ (null));
  #forget = () => {};

  /**
   * @param {Store} store
   * @param {AbortSignal} signal
   */
  constructor(store, signal) {
    this.#store = store;
    this.#signal = signal;
    this.#seeking = new NewestRequest((/** @type {number} */ frame) => this.send({ kind: "seek", frame }), {}, signal);
    const arrive = () => {
      if (store.session?.position === this.goal.value) this.goal.value = null;
    };
    follow(() => store.session?.position, arrive, signal);
  }

  get isPlaying() {
    return this.#store.session?.playing ?? false;
  }

  /** Whether the last frame is shown, so that playing means playing again. */
  get isAtEnd() {
    const { session } = this.#store;
    return session !== null && session.position >= session.frames - 1;
  }

  /** The shown or requested frame; keys pressed before it is shown count from it. */
  get frame() {
    return this.goal.value ?? this.#store.session?.goal ?? this.#store.session?.position ?? 0;
  }

  /** @param {Command} command Sent if the session is live. */
  async send(command) {
    return this.#store.isSteerable && !this.#signal.aborted ? steer(this.#store, command) : undefined;
  }

  async toggle() {
    await this.send({ kind: this.isPlaying ? "pause" : "play" });
  }

  /** Play from here; nothing happens at the end. */
  async play() {
    if (!this.isPlaying && !this.isAtEnd) await this.toggle();
  }

  async pause() {
    if (this.isPlaying) await this.toggle();
  }

  /** One frame forward or back.
   *
   * @param {number} direction
   */
  async step(direction) {
    if (direction > 0 ? !this.isAtEnd : (this.#store.session?.position ?? 0) > 0) await this.send({ kind: direction > 0 ? "step" : "back" });
  }

  /** Seek to a frame and stay there. During a seek only the newest request is kept.
   *
   * @param {number} frame
   */
  async seek(frame) {
    if (!this.#store.isSteerable) return;
    const { position, frames, goal: onTheWay } = this.#store.known;
    const goal = Math.min(Math.max(0, Math.round(frame)), frames - 1);
    this.#forget();
    // A seek under way may pass through this frame.
    const isThere = goal === position && (this.goal.peek() ?? onTheWay ?? position) === position;
    this.goal.value = isThere ? null : goal;
    await this.pause();
    await this.#seeking.ask(goal);
    if (this.goal.peek() !== goal) return; // it has arrived, or another goal replaced it
    this.#forget();
    this.#forget = later(() => (this.goal.value = null), GOAL_MS, this.#signal);
  }

  /** @param {number} frames */
  async jump(frames) {
    await this.seek(this.frame + frames);
  }

  /** Go to the newest computed frame; computing all the rest could take long. */
  async newest() {
    if (this.#store.isSteerable) await this.seek(this.#store.known.computed);
  }

  async beforeLoss() {
    const { beforeLoss } = this.#store;
    await (beforeLoss === null ? this.send({ kind: "before_loss" }) : this.seek(beforeLoss));
  }

  /** Go to the nearest computed frame with an event.
   *
   * @param {number} direction 1 for a later one, -1 for an earlier one.
   */
  async event(direction) {
    if (!this.#store.isSteerable) return;
    const frames = this.#store.eventFrames.filter((frame) => (frame - this.frame) * direction > 0);
    const goal = direction > 0 ? frames[0] : frames.at(-1);
    if (goal === undefined) toast(`No event ${direction > 0 ? "after" : "before"} this frame`);
    else await this.seek(goal);
  }

  /** @param {number} value Times real time; 0 is as fast as possible. */
  async setSpeed(value) {
    await this.send({ kind: "speed", speed: value });
  }

  /** Play slowly for a first-time viewer. */
  async slowDown() {
    const slow = this.#store.session?.speeds.findLast((speed) => speed > 0 && speed <= SLOW);
    if (slow !== undefined) await this.setSpeed(slow);
  }

  /** @param {number} direction */
  async faster(direction) {
    if (!this.#store.isSteerable) return;
    const { speed, speeds } = this.#store.known;
    const rank = (/** @type {number} */ each) => (each === 0 ? Infinity : each);
    const next = direction > 0 ? speeds.find((each) => rank(each) > rank(speed)) : speeds.findLast((each) => rank(each) < rank(speed));
    if (next !== undefined) await this.setSpeed(next);
  }
}

// The panel's proposals: the newest value of each parameter, one request at a time. A control keeps its proposal until the last request is
// answered and the session's own value has arrived.

/** The session's value arrives by the stream, mostly before the answer to the request, sometimes a little after it. */
const REST_MS = 300;

/** @typedef {Record<string, Value>} Values By the names of the parameters. */

/**
 * Change values of a session; a new seed restarts the run.
 *
 * @param {Pick<Store, "known">} store
 * @param {Values} values
 * @returns {Promise<boolean>} Whether they were accepted.
 */
export async function sendValues(store, { seed, ...values }) {
  if (Object.keys(values).length > 0 && !(await steer(store, { kind: "change", values }))) return false;
  return seed === undefined || Boolean(await steer(store, { kind: "restart", seed: Number(seed) }));
}

export class Proposals {
  /** @type {NewestRequest<Values, boolean>} */
  #requests;
  #end;
  #held = newSignal(/** @type {Values} */ ({}));
  #stopRest = () => {};

  /**
   * @param {(values: Values) => Promise<boolean>} send Returns whether the values were accepted.
   * @param {AbortSignal} end
   */
  constructor(send, end) {
    const join = (/** @type {Values} */ waiting, /** @type {Values} */ newer) => ({ ...waiting, ...newer });
    this.#requests = new NewestRequest(send, { answer: (isAccepted, _, isNewest) => isNewest && this.#rest(isAccepted), join }, end);
    this.#end = end;
  }

  /** Proposed values without an answer yet; components that read it follow it as a signal. */
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

  /** @param {boolean} isAccepted Refused values are dropped at once. */
  #rest(isAccepted) {
    const settle = () => (this.#held.value = {});
    if (isAccepted) this.#stopRest = later(settle, REST_MS, this.#end);
    else settle();
  }
}
