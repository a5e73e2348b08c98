/** What lies over the picture of a run: how far it is on its way, what to look at, and the frame in words. */

import { count } from "../shared/format.js";
import { IconButton } from "../shared/icons.js";
import { progressWords } from "../shared/jobs.js";
import { later } from "../shared/timing.js";
import { h, html, useEffect, useRef, useSignal, useSignalEffect } from "../vendor/preact.js";
import { isMeasured, state, words } from "./readings.js";

/** @import { Mounted } from "./mount.js" */
/** @import { Store } from "./store.js" */

/** Work that takes no longer ends before anybody could read about it. */
const SHOWN_AFTER_MS = 500;
const SETTLED_MS = 400;
/** The goal while functions are compiled: not a frame. */
const COMPILED = Infinity;
/** So long of the run the note on what to look at stays once that plays, s. */
const STAYS_S = 5;
/** A frame that a note names is played to, slowly, from so many before it. */
const BEFORE = 2;

/** @param {{view: Mounted}} props */
export function SceneNotes({ view }) {
  return html`
    <div class="scene-notes">${h(OnTheWay, { view })}</div>
    ${h(WatchNote, { view })}
    ${h(SpokenFrame, { view })}
  `;
}

/**
 * What a run is busy with that takes a while: many frames on its way to where it was or to a frame that was asked for, with the
 * button that stops it; or compiling what it uses for the first time.
 *
 * @param {{view: Mounted}} props
 */
function OnTheWay({ view: { store, commands } }) {
  const { session } = store;
  const compiled = session?.compiling ?? null;
  const goal = compiled === null ? (session?.goal ?? null) : COMPILED;
  const isBusy = goal !== null && store.connection === "open" && store.isAwake;
  const isLong = useSignal(false);
  const begun = useRef({ frame: 0, at: 0 });
  useEffect(() => {
    isLong.value = false;
    if (!isBusy) return undefined;
    begun.current = { frame: store.known.position, at: performance.now() };
    return later(() => (isLong.value = true), SHOWN_AFTER_MS);
  }, [goal, isBusy]);
  if (session === null || !isBusy || !isLong.value) return null;
  if (compiled !== null) {
    return html`<div class="on-the-way">
      <p role="status">Compiling what is used for the first time, ${count(compiled, "function")} so far</p>
      <progress aria-label="How far it is"></progress>
    </div>`;
  }
  const { position } = session;
  const { frame, at } = begun.current;
  const stop = html`<button type="button" title="Stop at the current frame" onClick=${() => commands.stop()}>Stop here</button>`;
  return html`<div class="on-the-way">
    <p role="status">${progressWords(position, goal, (performance.now() - at) / 1000, position - frame)}</p>
    <progress max="1" value=${goal > 0 ? position / goal : 1} aria-label="How far it is"></progress>
    ${!store.isReadOnly && stop}
  </div>`;
}

/**
 * What to look at, where the run began as a preset that says so, until it is put away, or the run has gone on for a while. The
 * frames that it names lead there.
 *
 * @param {{view: Mounted}} props
 */
function WatchNote({ view: { store, steering } }) {
  const isAway = useSignal(false);
  /** The frame from which it has been played. */
  const from = useRef(/** @type {number|null} */ (null));
  const { session } = store;
  useSignalEffect(() => {
    const { playing = false, position = 0, frame_rate_hz: rate = 0 } = store.session ?? {};
    // A person who steps through the frames still reads it.
    if (playing) from.current ??= position;
    if (from.current !== null && position > from.current + STAYS_S * rate) isAway.value = true;
  });
  if (session === null || session.watch === "" || isAway.value) return null;
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
    ${h(IconButton, { name: "close", title: "Put away", run: () => (isAway.value = true) })}
  </aside>`;
}

/**
 * The frame in words, for screen readers: spoken when the run stands still, not thirty times a second.
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
    .map((reading) => `${reading.title} ${words(reading, row, session)}`);
  const [verdict] = state(history, session);
  return `${[`Frame ${session.position} of ${session.frames}`, verdict, ...lines].filter(Boolean).join("; ")}.`;
}
