/**
 * A session as a component: any part of it in any element of a page, several per page, and removed completely when it is disposed. */

import { messageOf, progressWords, request, START, statusOf } from "../shared/api.js";
import { build, elementOf, fill, Notice, renderIn, toast } from "../shared/dom.js";
import { count } from "../shared/format.js";
import { socketAddress, Stream } from "../shared/stream.js";
import { later, until } from "../shared/timing.js";
import { isParticipant, remember, remembered } from "../shared/visitor.js";
import { h, html, options as drawing, signal as newSignal, useMemo, useRef, useSignal, useSignalEffect } from "../vendor/preact.js";
import { Panel } from "./panel.js";
import { plots } from "./plots/plots.js";
import { isMeasured, readingWords, state } from "./readings.js";
import { scrubber } from "./scrubber.js";
import { listen } from "./keys.js";
import { bookmark, steer, Steering } from "./steering.js";
import { Store } from "./store.js";
import { Bookmarks, Branches, Folded, Numbers, Status, transport } from "./transport.js";
import { Loss } from "./why/loss.js";
import { Beside, LostCard, WhyButton } from "./why/why.js";

/** @import { SessionMessage } from "../shared/messages.js" */
/** @import { SessionStart } from "./session_start.js" */
/** @import { Listener } from "../shared/stream.js" */
/** @import { Child } from "../vendor/preact.js" */

// The stream of a session: messages go to the store, drawings to the flat view, in one order.
//
// The head of a drawing holds all messages up to it. The page applies them when it can paint the drawing's pictures, and
// later messages wait until then: so all numbers next to a picture belong to it. The page reports what it has painted, because the server
// sends the newest drawing when the last but one is painted. With a 3-D scene, messages wait until the scene shows their frame.

export class SessionStream {
  #store;
  #scene;
  #signal;
  #stream;
  /** Numbers of received and of painted drawings of one connection. */
  #known = { came: 0, painted: 0 };
  /** Settled when everything received has been applied. */
  #line = Promise.resolve();

  /**
   * @param {string} id The session.
   * @param {import("./store.js").Store} store
   * @param {import("./scene.js").Scene|null} scene
   * @param {Pick<Listener<SessionMessage>, "lost"|"gone">} on
   * @param {AbortSignal} signal
   */
  constructor(id, store, scene, on, signal) {
    this.#store = store;
    this.#scene = scene;
    this.#signal = signal;
    const hears = {
      opened: () => (this.#known = { came: 0, painted: 0 }),
      message: (/** @type {SessionMessage} */ message) => this.#take(this.#seen(message)),
      drawing: (/** @type {ArrayBuffer} */ data) => this.#receive(data),
      ...on,
    };
    /** @type {Stream<SessionMessage>} */
    this.#stream = new Stream(hears, { address: () => this.#address(id), look: () => request("GET sessions/{session}", { session: id }), signal });
    if (scene) scene.onView = () => this.#stream.again();
  }

  /** @param {string} id */
  #address(id) {
    const flat = this.#scene?.flat ?? null;
    return socketAddress("WS sessions/{session}/stream", { session: id, ...(flat && { paints: true, has_picture: flat.hasPicture }) });
  }

  /** A message without a drawing waits for the 3-D scene, which gets its own drawing.
   *
   * @param {SessionMessage} message
   */
  async #seen(message) {
    await this.#scene?.comesTo("session" in message ? message.session.position : undefined);
    return { messages: [message] };
  }

  /** @param {ArrayBuffer} data */
  #receive(data) {
    const known = this.#known;
    known.came += 1;
    const came = known.came;
    const painted = () => {
      if (known !== this.#known || came <= known.painted) return;
      known.painted = came;
      this.#stream.send({ type: "painted", count: came });
    };
    const prepared = this.#scene?.flat?.prepare(data, painted);
    if (prepared !== undefined) this.#take(prepared);
  }

  /** Apply something when it is ready and everything before it has been applied.
   *
   * @param {Promise<{messages: SessionMessage[], show?: () => void}>} prepared
   */
  #take(prepared) {
    const known = this.#known;
    const take = async () => {
      const { messages, show } = await prepared;
      if (known !== this.#known || this.#signal.aborted) return;
      for (const message of messages) {
        if (message.type === "refused") toast(message.message, { kind: "error" });
        else this.#store.receive(message);
      }
      show?.();
    };
    this.#line = this.#line.then(take).catch((error) => globalThis.reportError(error));
  }
}

// Overlays on a run's picture: progress of a seek, the watch note, and the frame in words.

const SETTLED_MS = 400;
/** How long the watch note stays once the run plays, s of the run. */
const STAYS_S = 5;
/** Frames before a note's frame from which it is played slowly. */
const BEFORE = 2;

/** The progress of a long seek, with a button that stops it, or of compiling functions for their first use.
 *
 * @param {{view: Mounted}} props
 */
function OnTheWay({ view: { store } }) {
  const { session } = store;
  const goal = session?.goal ?? null;
  const [frame, at] = useMemo(() => [session?.position ?? 0, performance.now()], [goal]);
  if (session === null || store.connection.value !== "open" || !store.isAwake) return null;
  if (session.compiling !== null) {
    return html`<div class="on-the-way late">
      <p role="status">Compiling for first use, ${count(session.compiling, "function")} so far</p>
      <progress aria-label="Progress"></progress>
    </div>`;
  }
  if (goal === null) return null;
  const { position } = session;
  const stop = () => steer(store, { kind: "pause" });
  return html`<div key=${goal} class="on-the-way late">
    <p role="status">${progressWords(position, goal, (performance.now() - at) / 1000, position - frame)}</p>
    <progress max="1" value=${goal > 0 ? position / goal : 1} aria-label="Progress"></progress>
    ${!store.isReadOnly && html`<button type="button" title="Stop at the current frame" onClick=${stop}>Stop here</button>`}
  </div>`;
}

/** The preset's watch note, until the menu hides it or the run has played for a while. Frames in it are links.
 *
 * @param {{view: Mounted}} props
 */
function WatchNote({ view: { store, steering, hasNote } }) {
  /** The frame from which the run has played since. */
  const from = useRef(/** @type {number|null} */ (null));
  const { session } = store;
  useSignalEffect(() => {
    const { playing = false, position = 0, frame_rate_hz: rate = 0 } = store.session ?? {};
    // A person who steps through the frames still reads it.
    if (!hasNote.value) from.current = null;
    else if (playing) from.current ??= position;
    if (from.current !== null && position > from.current + STAYS_S * rate) hasNote.value = false;
  });
  if (session === null || session.watch === "" || !hasNote.value) return null;
  const show = async (/** @type {number} */ frame) => {
    await steering.seek(Math.max(0, frame - BEFORE));
    await steering.slowDown();
    await steering.play();
  };
  const parts = session.watch.split(/\b(frame \d+)\b/u).map((part, place) => {
    if (place % 2 === 0 || store.isReadOnly) return part;
    const frame = Number(part.slice("frame ".length));
    const look = { class: "link", title: `Go to frame ${frame}, slowly` };
    return html`<button type="button" ...${look} onClick=${() => show(frame)}>${part}</button>`;
  });
  return html`<aside class="look-at" aria-label="What to look at">
    <p>${parts}</p>
  </aside>`;
}

/**
 * The frame in words, for screen readers: spoken when the run is paused, not thirty times a second.
 *
 * @param {{view: Mounted}} props
 */
function SpokenFrame({ view: { store } }) {
  const said = useSignal("");
  useSignalEffect(() => {
    const sentence = store.session?.playing === false && inWords(store);
    return sentence ? later(() => (said.value = sentence), SETTLED_MS) : undefined;
  });
  return html`<p class="visually-hidden" role="status" data-role="in-words">${said.value}</p>`;
}

/** @param {Store} store */
function inWords({ known: session, history }) {
  const row = history.at(session.position);
  const lines = session.readings
    .filter((reading) => row !== undefined && reading.kind !== "time" && isMeasured(reading, row, session, history))
    .map((reading) => `${reading.title} ${readingWords(reading, row, session)}`);
  const [verdict] = state(history, session);
  return `${[`Frame ${session.position} of ${session.frames}`, verdict, ...lines].filter(Boolean).join("; ")}.`;
}

// Components are drawn with the next frame of the display, together with the picture that their numbers belong to.
drawing.debounceRendering = (draw) => requestAnimationFrame(draw);

/** The experiments already seen in this browser; a first visit plays slowly. */
const SEEN = "pftrack-seen";
const WAY = { label: isParticipant ? "Back to the class" : "Back to the experiments", href: START };
const KEPT = isParticipant ? "" : "Your saved runs are in My work.";

/** Whether this is the first visit of an experiment in this browser; the visit is stored.
 *
 * @param {string} experiment
 */
function isFirstVisit(experiment) {
  const seen = (remembered(SEEN) ?? "").split(" ");
  if (seen.includes(experiment)) return false;
  remember(SEEN, [...seen, experiment].join(" ").trim());
  return true;
}

/**
 * @typedef {object} Options
 * @property {Steering} [steering] The steering of the session that this one follows.
 * @property {readonly string[]} [plots] Ids of the plots to show; empty for all.
 * @property {Partial<import("./keys.js").Actions>} [actions] Further actions of keys.
 * @property {HTMLElement|null} [keys] Element in which the session handles keys: its own by default, none if null.
 * @property {boolean} [readOnly] Whether it can only be watched: keys of the camera work, those of the session do not.
 */

/** The view that parts need to show a run's course and move through it. Several runs in step share one.
 *
 * @typedef {Pick<Mounted, "store"|"steering"|"signal"|"scene"|"plots">} View
 */

/** A session mounted in an element, and the data that its parts need. */
export class Mounted {
  #start;
  /** @type {import("./inspector.js").Inspector|null} */
  #inspector = null;
  /** @type {Awaited<ReturnType<typeof plots>>|null} */
  #plots = null;
  /** @type {Loss|null} */
  #loss = null;

  /**
   * @param {SessionStart} start
   * @param {Options} options
   */
  constructor(start, { steering, plots: ids = [], actions = {}, readOnly = false, keys = readOnly ? null : start.element }) {
    this.#start = start;
    this.signal = start.signal;
    this.scene = start.scene;
    /** Ids of the plots to show; empty for all. */
    this.plots = ids;
    /** The card that replaces the plots. */
    this.card = newSignal(/** @type {"inspect"|"why"|"what-if"|null} */ (null));
    /** Content over the scene, such as the marking of the truth. */
    this.laid = newSignal(/** @type {Child} */ (null));
    /** Whether to show the watch note. */
    this.hasNote = newSignal(true);
    this.store = new Store({ readOnly });
    this.steering = steering ?? new Steering(this.store, this.signal);
    /** @type {Partial<import("./keys.js").Actions>} */
    this.actions = {
      bookmark: () => bookmark(this.store),
      branch: async () => this.store.isSteerable && (await import("./dialogs.js")).branchDialog(this),
      inspect: () => this.#look(),
      why: () => this.#loss?.open(),
      zoom: (factor) => this.#plots?.zoom(factor),
      truth: async () => !isParticipant && (await import("./marking.js")).markTruth(this),
      ...actions,
    };
    this.#fill();
    if (keys) listen(keys, this, this.actions);
    this.#begin();
  }

  /** Remove the session from the page and end all its work here. The session itself stays. */
  dispose() {
    this.#start.end();
  }

  /** Begin or stop inspecting the frame. */
  async #look() {
    const { inspection: place } = this.#start.places;
    if (!place || this.store.isReadOnly) return;
    const { Inspection, Inspector } = await import("./inspector.js");
    if (this.signal.aborted) return;
    if (this.#inspector === null) {
      this.#inspector = new Inspector(this);
      renderIn(place, h(Inspection, { inspector: this.#inspector }), this.signal);
    }
    this.#inspector.toggle();
  }

  #fill() {
    const { places } = this.#start;
    const loss = (this.#loss = places.why && !this.store.isReadOnly ? new Loss(this) : null);
    const status = h(Status, { view: this, ask: loss && h(WhyButton, { loss }) });
    const numbers = places.status ? h(Folded, { view: this, plots: places.plots ?? null }) : [status, h(Numbers, { view: this })];
    if (places.transport) transport(places.transport, this, h(Bookmarks, { view: this }));
    if (places.scrubber) scrubber(places.scrubber, this);
    if (places.panel) renderIn(places.panel, h(Panel, { view: this }), this.signal);
    if (places.why && loss) renderIn(places.why, h(Beside, { loss }), this.signal);
    if (places.status) renderIn(places.status, status, this.signal);
    if (places.readout) renderIn(places.readout, numbers, this.signal);
    if (places.branches) renderIn(places.branches, h(Branches, { view: this, place: places.branches }), this.signal);
    if (places.plots) plots(places.plots, this).then((drawn) => (this.#plots = drawn));
    if (!this.scene) return;
    this.scene.follow(this);
    const over = build("div", { class: "made" });
    // The card of a loss is read before the switch of views, above which it lies.
    this.scene.root.lastElementChild?.before(over);
    renderIn(over, h(() => html`
      ${loss && h(LostCard, { loss })}
      <div class="scene-notes">${h(OnTheWay, { view: this })}</div>
      ${h(WatchNote, { view: this })}
      ${h(SpokenFrame, { view: this })}
      ${this.laid.value}
    `, {}), this.signal);
  }

  async #begin() {
    const begun = await this.#start.begun.catch((error) => this.#refuse(error));
    if (!begun || this.signal.aborted) return;
    const { session, recipe } = begun;
    const on = {
      lost: () => (this.store.connection.value = "lost"),
      gone: (/** @type {Error} */ { message }) => {
        this.store.connection.value = "gone";
        this.#fail("This session has ended", isParticipant ? message : KEPT);
      },
    };
    new SessionStream(session.id, this.store, this.scene, on, this.signal);
    if (!recipe?.play) return;
    await this.scene?.seen;
    await until(() => this.store.isSteerable, this.signal);
    if (isFirstVisit(session.recipe.experiment)) await this.steering.slowDown();
    await this.steering.toggle();
  }

  /** @param {unknown} error */
  #refuse(error) {
    const { isNew } = this.#start;
    if (statusOf(error) === 404 && !isNew) this.#fail("Session not found", `It may have ended. ${KEPT}`.trim());
    else this.#fail(isNew ? "Couldn't start this session" : "Couldn't show this session", messageOf(error));
  }

  /**
   * @param {string} title
   * @param {string} message
   */
  #fail(title, message) {
    if (this.signal.aborted) return;
    const way = this.store.isReadOnly ? null : WAY;
    if (this.scene) this.scene.fail(title, message, way);
    else fill(this.#start.element, elementOf(h(Notice, { title, message, action: way, inline: false })));
  }
}
