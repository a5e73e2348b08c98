/** The page of a class's follower: the lecturer's content and arrangement, read-only. */

import { request } from "../shared/api.js";
import { Poll } from "../lecturer/poll.js";
import { sessionTitle } from "../session/steering.js";
import { ask } from "../shared/dialog.js";
import { attempt, Notice, part } from "../shared/dom.js";
import { speed } from "../shared/format.js";
import { Doing } from "../shared/page.js";
import { isPlain } from "../shared/presentation.js";
import { socketAddress, Stream } from "../shared/stream.js";
import { computed, effect, h, html, render, signal } from "../vendor/preact.js";
import { ClassView } from "./class_view.js";

/** @import { Mounted } from "../session/mount.js" */
/** @import { FigureShown, FollowNews, FollowPublic, MinePublic } from "../shared/messages.js" */

/** The state of the connection to the class: it may be full or ended; the sentence gives the reason.
 *
 * @typedef {{is: "connecting"|"open"|"lost"|"full"|"over", sentence?: string}} State
 */

const WORDS = { connecting: "Connecting", open: "Following", lost: "Reconnecting", full: "Waiting", over: "Ended" };
const OVER = 4404;
const FULL = 4429;

const state = signal(/** @type {State} */ ({ is: "connecting" }));
const follow = signal(/** @type {FollowPublic|null} */ (null));
const mine = signal(/** @type {MinePublic} */ ({ fork: null, vote: null }));
const figure = signal(/** @type {FigureShown|null} */ (null));
/** The shown sessions. */
const views = signal(/** @type {readonly Mounted[]} */ ([]));
/** The answer to the poll, if one was given. */
const answered = computed(() => {
  const { vote: given } = mine.value;
  return given !== null && given.poll === follow.value?.poll?.id ? given.answer : null;
});

const stream = new Stream(
  {
    message: receive,
    // A full class may have room at the next attempt.
    lost: () => state.value.is !== "full" && become("lost"),
    closed: ({ code, reason }) => {
      if (code === FULL) become("full", `${reason} This page joins automatically as soon as there is a place.`);
      if (code !== OVER) return;
      stream.stop();
      become("over", reason);
    },
    gone: (error) => become("over", error.message),
  },
  { address: () => socketAddress("WS follow/stream"), look: () => request("GET follow") },
);

/** @param {FollowNews|FigureShown} message */
function receive(message) {
  if (message.type === "figure") {
    figure.value = message;
    return;
  }
  follow.value = message.follow;
  // A message to all contains nothing about one follower.
  mine.value = message.follow.mine ?? mine.value;
  if (message.type === "hello") become("open");
}

/**
 * @param {State["is"]} is
 * @param {string} [sentence]
 */
function become(is, sentence = "") {
  state.value = { is, sentence };
}

/** @param {number} answer */
async function vote(answer) {
  const poll = follow.value?.poll;
  if (!poll || poll.revealed || answer >= poll.answers.length || state.value.is !== "open") return;
  const given = await attempt(() => request("PUT follow/vote", { body: { poll: poll.id, answer } }));
  if (given !== undefined) mine.value = { ...mine.value, vote: given };
}

/** The whole page. */
function Follow() {
  const { is, sentence = "" } = state.value;
  const isThere = is !== "full" && is !== "over";
  const title = is === "full" ? "This class is full" : "The class has ended";
  const wait = html`<div class="late follow-wait"><div class="shimmer"></div></div>`;
  const shown = follow.value === null ? wait : h(ClassView, { follow, figure, views });
  return html`
    <div class="bar-lost" role="status" hidden=${is !== "lost" || follow.value === null}>Reconnecting</div>
    <header class="top">
      <span class="brand">pftrack</span>
      <h1>${follow.value?.title ?? "A class"}</h1>
      ${h(FollowingLine, {})}
    </header>
    <main>${isThere ? shown : h(Notice, { title, message: sentence, action: null, inline: true })}</main>
    ${isThere && follow.value !== null && h(Foot, { follow: follow.value })}
  `;
}

/** A line on the connection and the lecturer's frame. */
function FollowingLine() {
  const { is } = state.value;
  const session = is === "open" ? views.value.at(0)?.store.session : null;
  const playing = session?.playing && (session.speed === 0 ? "playing as fast as possible" : `playing ${speed(session.speed)}`);
  const position = session && `frame ${session.position} of ${session.frames}`;
  return html`<p class="following" data-state=${is}>${[WORDS[is], position, playing].filter(Boolean).join(" · ")}</p>`;
}

/** @param {{follow: FollowPublic}} props */
function Foot({ follow: { poll, sessions, lesson } }) {
  const isEmpty = sessions.length === 0 && lesson === null;
  return html`<footer class="follow-foot">
    ${poll !== null && html`<div class="follow-poll">${h(Poll, { poll, own: answered.value, vote })}</div>`}
    ${!isEmpty && html`<div class="follow-try">${h(Try, { sessions: sessions.map(({ id }) => id), lesson })}</div>`}
  </footer>`;
}

/** A button for the follower's own copy of a session at the lecturer's frame, or of the lesson.
 *
 * @param {{sessions: string[], lesson: string|null}} props
 */
function Try({ sessions, lesson }) {
  const { fork: own } = mine.value;
  // The own copy of a lesson ends when the class moves to another lesson.
  const isOpen = own !== null && (own.id !== null || own.page === `learn/${lesson}`);
  const run = async () => {
    const session = sessions.length > 1 && !isOpen ? await choose() : (sessions.at(0) ?? null);
    if (session === undefined) return;
    await attempt(async () => {
      // The copy of a lesson that the class has left keeps its place, though nobody can open it.
      if (own !== null && !isOpen) await request("DELETE follow/fork");
      location.assign(isOpen ? own.page : (await request("POST follow/fork", { body: { session } })).page);
    });
  };
  const label = isOpen ? "Continue with your own copy" : "Try it yourself";
  return h(Doing, { label, run, disabled: state.value.is !== "open", class: "primary" });
}

/** @returns {Promise<string|undefined>} The chosen session, if any. */
async function choose() {
  const sessions = views.value.flatMap(({ store }) => store.session ?? []);
  const choice = (/** @type {typeof sessions[number]} */ session) => html`<button value=${session.id}>${sessionTitle(session)}</button>`;
  return (await ask("Which session?", html`<div class="fork-choices">${sessions.map(choice)}</div>`)) || undefined;
}

effect(() => {
  if (follow.value !== null) document.title = `${follow.value.title} · pftrack`;
});
document.addEventListener("keydown", (event) => {
  if (/^[1-8]$/.test(event.key) && isPlain(event)) vote(Number(event.key) - 1);
});
render(h(Follow, {}), part("class"));
