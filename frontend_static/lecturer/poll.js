/** Polls: the question with its answers, and, once these are revealed, a bar with figures for each and a sentence below; the form for a new
 poll; and the stored polls. */

import { request } from "../shared/api.js";
import { confirmLoss } from "../shared/dialog.js";
import { attempt, IconButton } from "../shared/dom.js";
import { count, moment, percent } from "../shared/format.js";
import { h, html, useRef, useSignal } from "../vendor/preact.js";

/** @import { PollKept, PollPublic } from "../shared/messages.js" */
/** @import { Child } from "../vendor/preact.js" */
/** @import { ClassControl } from "./class_control.js" */

/** Number of letters from which a presented question takes several lines. */
const LONG = 90;
/** Number of answer fields at first; a poll needs at least this many answers. */
const FIRST = ["Yes", "No"];
const MOST = 8;
const IN_A_SENTENCE = new Intl.ListFormat("en-GB");

/**
 * @typedef {object} PollProps
 * @property {PollPublic} poll
 * @property {number|null} [own] Index of the viewer's own answer.
 * @property {number} [followers] Number of followers, where known.
 * @property {((answer: number) => void)|null} [vote] Called with the chosen answer; null for a viewer who does not vote.
 * @property {Child} [tools] Buttons for the whole poll.
 */

/** @param {PollProps} props */
export function Poll({ poll, own = null, followers, vote = null, tools = null }) {
  const { question, answers, counts } = poll;
  const votes = counts === null ? 0 : sumOf(counts);
  const lines = answers.map((text, place) => {
    const isOwn = own === place;
    if (counts !== null) return h(Bar, { text, isOwn, amount: counts[place], share: votes === 0 ? 0 : counts[place] / votes });
    const content = html`<span class="poll-place" aria-hidden="true">${isOwn ? "✓" : place + 1}</span><span>${text}</span>`;
    if (vote === null) return html`<div class="poll-answer">${content}</div>`;
    return html`<button type="button" class="poll-answer" aria-pressed=${String(isOwn)} onClick=${() => vote(place)}>${content}</button>`;
  });
  return html`<section class="poll" aria-label="Poll" data-revealed=${counts !== null || null} data-long=${question.length > LONG || null}>
    <h2>${question}</h2>
    <ol class="poll-answers">${lines.map((line) => html`<li>${line}</li>`)}</ol>
    <div class="poll-line"><p class="hint" role="status">${pollWords(poll, { own, followers, asks: vote !== null })}</p>${tools}</div>
  </section>`;
}

/** @param {{text: string, isOwn: boolean, amount: number, share: number}} props */
function Bar({ text, isOwn, amount, share }) {
  return html`<div class="poll-bar">
    <span class="poll-text">${text}${isOwn && html`<span class="poll-own"> · your answer</span>`}</span>
    <span class="poll-count">${amount} · ${percent(share)}</span>
    <span class="poll-track" aria-hidden="true"><i style=${{ width: `${100 * share}%` }}></i></span>
  </div>`;
}

/** The poll of a class with its lecturer's buttons; nothing without a poll.
 *
 * @param {{control: ClassControl, tools?: Child}} props `tools` come before the buttons that reveal and withdraw.
 */
export function ClassPoll({ control, tools = null }) {
  const { poll = null, followers } = control.follow.value ?? {};
  if (poll === null) return null;
  const reveal = html`<button type="button" class="primary" data-role="reveal" onClick=${() => control.reveal()}>Reveal</button>`;
  const words = poll.revealed ? "Close" : "Withdraw";
  const withdraw = html`<button type="button" data-role="withdraw" onClick=${() => control.withdraw()}>${words}</button>`;
  return h(Poll, { poll, followers, tools: [tools, !poll.revealed && reveal, withdraw] });
}

/**
 * The form of a poll: one question and two to eight answers. Empty answers are left out.
 *
 * @param {{ask: (poll: {question: string, answers: string[]}) => unknown, action: string}} props `false` keeps the form as it is.
 */
export function PollForm({ ask, action }) {
  const amount = useSignal(FIRST.length);
  const newest = useRef(/** @type {HTMLElement|null} */ (null));
  const submit = async (/** @type {Event & {currentTarget: HTMLFormElement}} */ event) => {
    event.preventDefault();
    const form = event.currentTarget;
    const [question, ...answers] = [...new FormData(form).values()].map((text) => String(text).trim());
    if ((await ask({ question, answers: answers.filter(Boolean) })) === false) return;
    form.reset();
    amount.value = FIRST.length;
  };
  const add = () => {
    amount.value += 1;
    requestAnimationFrame(() => newest.current?.focus());
  };
  const field = (/** @type {number} */ place) => html`<li>
    <input
      ref=${newest} type="text" name="answer" required=${place in FIRST} autocomplete="off" maxlength="100" defaultValue=${FIRST[place] ?? ""}
      aria-label=${`Answer ${place + 1}`}
    />
  </li>`;
  return html`<form class="poll-form" onSubmit=${submit}>
    <label for="poll-question">Question</label>
    <input type="text" id="poll-question" name="question" required autocomplete="off" maxlength="300" placeholder="Will it survive the pillar?" />
    <ol class="poll-fields">${[...new Array(amount.value).keys()].map(field)}</ol>
    <div class="poll-line">
      ${amount.value < MOST && html`<button type="button" class="quiet" onClick=${add}>Another answer</button>`}
      <button type="submit" class="primary">${action}</button>
    </div>
  </form>`;
}

/** The stored polls: a line for each, which unfolds its bars.
 *
 * @typedef {object} AnsweredProps
 * @property {readonly PollKept[]} kept
 * @property {boolean} [isOpen] Whether all bars are unfolded.
 * @property {() => unknown} [removed] Called after a deletion; without it polls cannot be deleted.
 * @property {(poll: PollKept) => unknown} [again] Show its answers to the class again.
 */

/** @param {AnsweredProps} props */
export function Answered({ kept, isOpen = false, removed, again }) {
  const line = (/** @type {PollKept} */ poll) => {
    const { id, question, votes, followers, lecture_title: lecture, title, asked } = poll;
    const remove = async () => {
      const text = `“${question}” and its ${count(votes, "answer")} are deleted permanently, unless you downloaded them.`;
      const deleted = () => request("DELETE polls/{poll}", { poll: id }).then(removed);
      if (await confirmLoss({ title: "Delete this poll?", text, action: "Delete it" })) await attempt(deleted);
    };
    const tools = [
      again && html`<button type="button" onClick=${() => again(poll)}>Show again</button>`,
      removed && h(IconButton, { name: "trash", title: `Delete ${question}`, run: remove }),
    ];
    return html`<li key=${id}>
      <details data-poll=${id} open=${isOpen}>
        <summary class="row">
          <span class="row-words">
            <span class="row-title">${question}</span>
            <span class="hint">${lecture ?? title}, ${votes} of ${followers} answered, ${moment(asked)}</span>
          </span>
        </summary>
        ${h(Poll, { poll: { ...poll, lesson: null, revealed: true }, tools })}
      </details>
    </li>`;
  };
  return html`<ul class="rows answered">${kept.map(line)}</ul>`;
}

/** The state of a poll as a sentence; with the result once it is shown.
 *
 * @param {PollPublic} poll
 * @param {{own?: number|null, followers?: number, asks: boolean}} beside The viewer's own answer, the number of followers, and whether the
 viewer votes. */
export function pollWords({ answers, counts, votes }, { own = null, followers, asks }) {
  if (counts !== null) return resultWords(answers, counts);
  if (asks && own === null) return "Click or tap an answer, or press its number; nobody sees who answered what.";
  if (asks) return `You answered “${answers[/** @type {number} */ (own)]}”. You can change this until the answers are revealed.`;
  if (votes === null) return "No followers yet: ask for a show of hands.";
  const all = followers === undefined ? "" : ` of ${followers}`;
  return `${votes}${all} ${votes === 1 ? "has" : "have"} answered. Everybody sees the answers when you reveal them.`;
}

/**
 * "Most answered “No”, 14 of 23; “Yes” 9."
 *
 * @param {readonly string[]} answers
 * @param {readonly number[]} counts
 */
export function resultWords(answers, counts) {
  const votes = sumOf(counts);
  if (votes === 0) return "Nobody has answered.";
  const ranked = answers.map((text, place) => ({ text: `“${text}”`, amount: counts[place] })).sort((a, b) => b.amount - a.amount);
  const most = ranked[0].amount;
  const ahead = ranked.filter(({ amount }) => amount === most).map(({ text }) => text);
  const rest = ranked.slice(ahead.length).map(({ text, amount }) => `${text} ${amount}`).join(", ");
  const figures = `${most} of ${votes}${rest && `; ${rest}`}.`;
  if (ahead.length > 1) return `${IN_A_SENTENCE.format(ahead)} were answered equally often, each ${figures}`;
  return 2 * most > votes ? `Most answered ${ahead[0]}, ${figures}` : `${ahead[0]} was answered most often, ${figures}`;
}

/** @param {readonly number[]} amounts */
function sumOf(amounts) {
  return amounts.reduce((total, each) => total + each, 0);
}
