/** A class on its lecturer's page: the dialog of the chip in the header, with the link and its QR code, a poll, the limits and the end; and
 the class's poll over the page. The page can also be added to a lecture here. */

import { addressOf, request } from "../shared/api.js";
import { confirmLoss, dialogIsOpen, openDialog } from "../shared/dialog.js";
import { attempt, CopyButton, elementOf, Icon, Select, toast } from "../shared/dom.js";
import { moment } from "../shared/format.js";
import { Doing } from "../shared/page.js";
import { isPresenting, isTyping, presentNext } from "../shared/presentation.js";
import { follow as whenChanged } from "../shared/timing.js";
import { isParticipant } from "../shared/visitor.js";
import { computed, effect, h, html, signal, useEffect, useSignal } from "../vendor/preact.js";
import { following, takeClassAlong, walkOfTab } from "./class_control.js";
import { itemOfAddress } from "./items.js";
import { Answered, ClassPoll, Poll, PollForm } from "./poll.js";
import { begin, clock, clockWords, endWalk, go, hostOf, markAsked, opened, pageOf } from "./walk.js";

/** @import { FollowOwned, LectureSummary, PollCreateRequest, PollKept } from "../shared/messages.js" */
/** @import { Signal } from "../vendor/preact.js" */
/** @import { ClassControl } from "./class_control.js" */
/** @import { Walk } from "./walk.js" */

// Presenting a lecture: its start or continuation, and its line on each of its pages: the item's number, the next item, the clock, and
// Previous and Next. N, and the keys of presenters' remote controls, page up and page down, work as Previous and Next. The class comes
// along if it sees the page.

const SECOND_MS = 1000;
/** Elements that use page up and page down themselves. */
const USES_PAGE_KEYS = "input:not([type=checkbox], [type=radio]), textarea, select, [contenteditable]";
/** While presenting, only text fields keep these keys: the presenter's remote control sends them. */
const IS_WRITTEN_IN = "input[type=text], input[type=number], input[type=search], textarea, [contenteditable]";
const now = signal(Date.now());
/** Address of an existing session; a new session starts again wherever it is opened. */
const SESSION = /^session\/(?!new)([^/?#]+)/;

/**
 * Show the first item.
 *
 * @param {Parameters<typeof begin>[0]} lecture
 */
export function beginLecture(lecture) {
  const walk = begin(lecture, Date.now());
  if (walk === null) toast("Nothing to show yet: add a lesson, a failure, a session or a comparison.", { kind: "error" });
  else open(walk);
}

/** Show the item at which the lecturer stopped, in presentation, also to the class of this tab.
 *
 * @param {Walk} walk
 */
export function open(walk) {
  walkOfTab.set(walk);
  takeClassAlong();
  presentNext();
  location.assign(pageOf(walk));
}

/** Show the lecture's line, if this tab presents a lecture.
 *
 * @param {ClassControl} control
 * @param {AbortSignal} ends Its abort removes it.
 */
function lectureLine(control, ends) {
  const walk = isParticipant ? null : walkOfTab.get();
  if (walk === null || walk.ended !== null) return;
  const held = new Held(walk, control);
  const [line, hands] = [elementOf(h(Line, { held })), elementOf(h(ShowOfHands, { held }))];
  const top = document.querySelector(".top");
  // In presentation it is in the page's first line, which may be filled just now, and repeats that line's text.
  whenChanged(isPresenting, () => queueMicrotask(() => (isPresenting() ? top?.prepend(line) : top?.after(line))), ends);
  ends.addEventListener("abort", effect(() => held.ask()));
  document.body.append(hands);
  // On the page itself N means a branch or the next lesson, so the lecture handles it first. Lists and figures handle the page keys first.
  document.addEventListener("keydown", (event) => event.key.toLowerCase() === "n" && held.press(event), { capture: true, signal: ends });
  document.addEventListener("keydown", (event) => held.press(event), { signal: ends });
  const ticking = setInterval(() => (now.value = Date.now()), SECOND_MS);
  ends.addEventListener("abort", () => clearInterval(ticking));
  ends.addEventListener("abort", () => [line, hands].forEach((element) => element.remove()));
}

/** The presented lecture on this page. */
class Held {
  #control;
  #isLeaving = false;
  walk;
  step = computed(() => this.walk.value.steps[this.walk.value.at]);
  isLast = computed(() => this.walk.value.at + 1 === this.walk.value.steps.length);
  /** Whether the class's poll is revealed; undefined without a poll. */
  isRevealed = computed(() => (this.#control.isHere.value ? this.#control.follow.value?.poll?.revealed : undefined));
  /** Whether the class's poll is that of this step. */
  canReveal = computed(() => this.step.value.asks !== null && this.isRevealed.value === false);
  /** The question for a show of hands, if nobody follows. */
  hands = computed(() => (this.#control.follow.value === null && !this.#isLeaving ? this.step.value.asks : null));

  /**
   * @param {Walk} walk
   * @param {ClassControl} control
   */
  constructor(walk, control) {
    this.#control = control;
    this.walk = signal(walk);
    effect(() => walkOfTab.set(this.walk.value));
  }

  /** Ask the class this step's question, once. */
  ask() {
    const { asks, asked: isAsked } = this.step.value;
    if (asks === null || isAsked || this.#isLeaving || !this.#control.isHere.value) return;
    this.walk.value = markAsked(this.walk.value);
    this.#control.ask(asks);
  }

  /** Page down: first reveal the poll, then go to the next item. */
  onward() {
    if (this.canReveal.value) this.#control.reveal();
    else if (this.isLast.value) this.#finish();
    else this.go(1);
  }

  /** @param {number} by */
  async go(by) {
    if (this.#isLeaving) return;
    if (this.isRevealed.value) await this.#control.withdraw();
    const walk = this.walk.value;
    const here = location.href.replace(document.baseURI, "");
    const isBegun = SESSION.test(here) && walk.steps[hostOf(walk)].kind === "session";
    const next = go(isBegun ? opened(walk, here) : walk, by, Date.now());
    this.#isLeaving = hostOf(next) !== hostOf(walk);
    this.walk.value = next;
    if (!this.#isLeaving) return;
    await this.#forgetEnded();
    this.#control.takeAlong();
    location.assign(pageOf(this.walk.value));
  }

  /** @param {KeyboardEvent} event */
  press(event) {
    const { key, target, ctrlKey, metaKey, altKey, shiftKey, defaultPrevented } = event;
    const isOnward = ["n", "N", "PageDown"].includes(key);
    if (!isOnward && key !== "PageUp") return;
    if (defaultPrevented || ctrlKey || metaKey || altKey || shiftKey || dialogIsOpen() || !isFree(key, target)) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    if (isOnward) this.onward();
    else if (this.walk.value.at > 0) this.go(-1);
  }

  /** The session started for a step may have ended since. */
  async #forgetEnded() {
    const session = SESSION.exec(pageOf(this.walk.value))?.[1];
    if (session === undefined) return;
    const gone = () => (this.walk.value = opened(this.walk.value, null));
    await request("GET sessions/{session}", { session: decodeURIComponent(session) }).catch(gone);
  }

  #finish() {
    this.#isLeaving = true;
    this.walk.value = endWalk(this.walk.value, Date.now());
    location.assign(`lectures/${encodeURIComponent(this.walk.value.lecture)}`);
  }
}

/** @param {{held: Held}} props */
function Line({ held }) {
  const [walk, isLast] = [held.walk.value, held.isLast.value];
  const after = isLast ? "the last one" : `then ${walk.steps[walk.at + 1].title}`;
  const onward = isLast ? "Finish" : "Next";
  return html`<nav class="lecture-bar" aria-label="Lecture">
    <button type="button" class="quiet" title="Previous (page up)" disabled=${walk.at === 0} onClick=${() => held.go(-1)}>
      ${h(Icon, { name: "previous" })}<span class="wide-only">Previous</span>
    </button>
    <span class="lecture-count">${walk.at + 1} of ${walk.steps.length}</span>
    <a class="lecture-place" href=${pageOf(walk)} title=${`${walk.title}: go to this item`}>${held.step.value.title}</a>
    <span class="hint lecture-coming">${after}</span>
    ${h(Clocks, { walk })}
    <button type="button" class="primary" title="Next (N, page down)" data-role="lecture-next" onClick=${() => held.onward()}>
      <span>${held.canReveal.value ? "Reveal" : onward}</span>${h(Icon, { name: "next" })}
    </button>
  </nav>`;
}

/** @param {{walk: Walk}} props */
function Clocks({ walk }) {
  const { whole, step } = clock(walk, now.value);
  const one = (/** @type {string} */ what, /** @type {{taken: number, planned: number}} */ clocked) =>
    html`<span class="lecture-clock" data-over=${clocked.taken > clocked.planned || null}>${what} ${clockWords(clocked)}</span>`;
  return html`<span class="lecture-clocks" role="timer" aria-label="Clock">${one("this", step)}${one("all", whole)}</span>`;
}

/** @param {{held: Held}} props */
function ShowOfHands({ held }) {
  const { question = null, answers = null } = held.hands.value ?? {};
  const isThere = question !== null && answers !== null;
  return html`<aside class="lead-poll" aria-label="A show of hands">
    ${isThere && h(Poll, { poll: { id: question, question, answers, votes: null, counts: null, revealed: false, lesson: null } })}
  </aside>`;
}

/** Whether the lecture may handle a key: the focused element may need it. The scene keeps the keys that it needs.
 *
 * @param {string} key
 * @param {EventTarget|null} target
 */
function isFree(key, target) {
  if (!(target instanceof Element) || target instanceof HTMLIFrameElement) return true;
  if (key.length === 1) return !isTyping(target);
  return isPresenting() ? target.closest(IS_WRITTEN_IN) === null : target.closest(USES_PAGE_KEYS) === null && !scrolls(target);
}

/**
 * Whether an element within the page has more than it shows.
 *
 * @param {Element} target
 */
function scrolls(target) {
  for (let element = /** @type {Element|null} */ (target); element !== null && element !== document.body; element = element.parentElement) {
    if (element.scrollHeight > element.clientHeight + 1 && /auto|scroll/.test(getComputedStyle(element).overflowY)) return true;
  }
  return false;
}

/** @typedef {"folded"|"whole"|"staged"} Size Size of a poll: one line, over the page's lower edge, or the whole page in presentation. */

const WHAT =
  "Everybody who opens a short link sees what you show here: the same frame, the same parameters, read only. " +
  "No names. Polls keep only the counts.";
const MOST_BEFORE = 20;
const NEW = { id: "", title: "a new lecture" };

/** Show the parts of a class and a lecture on each page of the tab that leads it: the lecture's line, and the poll. In presentation, a
 * result fills the page until the next key.
 *
 * @param {ClassControl} control
 * @param {AbortSignal} end Its abort removes it.
 */
export function lead(control, end) {
  const size = signal(/** @type {Size} */ ("whole"));
  let before = /** @type {string|null} */ (null);
  end.addEventListener("abort", effect(() => {
    const { id = "", revealed = false } = control.follow.value?.poll ?? {};
    const current = control.follow.value && `${id} ${revealed}`;
    // A result that the previous page revealed is already known.
    if (current !== before) size.value = revealed && before !== null ? "staged" : "whole";
    before = current;
  }));
  document.addEventListener("keydown", (event) => {
    if (size.value !== "staged" || !isPresenting() || dialogIsOpen() || isForBrowser(event)) return;
    // This key closed the result; the next one belongs to the page again.
    event.preventDefault();
    event.stopImmediatePropagation();
    size.value = "folded";
  }, { capture: true, signal: end });
  const poll = elementOf(h(LeadPoll, { control, size }));
  (document.querySelector(".top") ?? document.body.firstElementChild)?.after(poll);
  end.addEventListener("abort", () => poll.remove());
  lectureLine(control, end);
}

/** @param {{control: ClassControl, size: Signal<Size>}} props */
function LeadPoll({ control, size }) {
  const isFolded = size.value === "folded";
  const turn = () => (size.value = isFolded ? "whole" : "folded");
  const fold = html`<button type="button" class="quiet" data-role="fold" aria-expanded=${String(!isFolded)} onClick=${turn}>
    ${isFolded ? "Unfold" : "Fold"}
  </button>`;
  return html`<aside
    class="lead-poll" aria-label="Poll of the class" data-folded=${isFolded || null} data-staged=${size.value === "staged" || null}
  >
    ${h(ClassPoll, { control, tools: fold })}
  </aside>`;
}

/** Whether a key moves the focus, presses the focused button, or is a modifier.
 *
 * @param {KeyboardEvent} event
 */
function isForBrowser({ key, target, ctrlKey, metaKey, altKey }) {
  if (ctrlKey || metaKey || altKey || ["Tab", "Shift"].includes(key)) return true;
  return (key === " " || key === "Enter") && target instanceof Element && target.closest(".lead-poll button") !== null;
}

/** @param {ClassControl} control */
export function openClassDialog(control) {
  openDialog("Class", (close) => h(Sheet, { control, close }), "wide");
}

/** @param {{control: ClassControl, close: () => void}} props */
function Sheet({ control, close }) {
  const follow = control.follow.value;
  const mayBegin = control.mayBegin.value;
  const isOver = follow === null && !mayBegin;
  useEffect(() => void (isOver && close()), [isOver]);
  return html`
    <div class="class-sheet">${follow === null ? h(Begin, { control }) : h(Running, { key: follow.id, control, follow, close })}</div>
    ${mayBegin && h(AddToLecture, {})}
  `;
}

/** Before a class begins: an explanation, and the existing classes.
 *
 * @param {{control: ClassControl}} props
 */
function Begin({ control }) {
  const others = useSignal(/** @type {FollowOwned[]} */ ([]));
  useEffect(() => void request("GET follows").then((all) => (others.value = all), () => {}), []);
  const other = (/** @type {FollowOwned} */ follow) => html`<li class="row">
    <span class="row-words"><span class="row-title">${follow.title}</span><span class="hint">${following(follow.followers)}</span></span>
    <button type="button" class="row-actions" onClick=${() => control.show(follow)}>Show this page to it</button>
  </li>`;
  return html`
    <p>${WHAT}</p>
    <footer>${h(Doing, { label: "Begin", run: () => control.show(), class: "primary", autofocus: true })}</footer>
    ${others.value.length > 0 && html`<ul class="class-others" aria-label="Running classes">${others.value.map(other)}</ul>`}
  `;
}

/** @param {{control: ClassControl, follow: FollowOwned, close: () => void}} props */
function Running({ control, follow, close }) {
  const { title, followers } = follow;
  const finish = async () => {
    const text = `${following(followers)}. The link stops working, and the followers' own copies end, too.`;
    if (followers === 0 || (await confirmLoss({ title: "End the class?", text, action: "End for all" }))) await control.end();
  };
  const here = html`<button type="button" class="primary" disabled=${!control.shown.value} onClick=${() => control.show(follow)}>Show this page</button>`;
  return html`
    ${!control.isHere.value && html`<p class="note class-elsewhere"><span>The class sees ${title}. </span>${here}</p>`}
    ${h(Link, { follow })}
    ${h(Asking, { control, close })}
    ${h(Limits, { control, follow })}
    <footer><button type="button" class="danger" data-role="end-class" onClick=${finish}>End</button></footer>
  `;
}

/** Numbers of followers and of own copies, and the limit of followers.
 *
 * @param {{control: ClassControl, follow: FollowOwned}} props
 */
function Limits({ control, follow: { followers, forks, most_followers: most, expires } }) {
  const copies = forks === 1 ? "1 own copy" : `${forks || "no"} own copies`;
  const change = async (/** @type {Event & {currentTarget: HTMLInputElement}} */ { currentTarget: field }) => {
    if (field.reportValidity() && !(await control.change({ most_followers: field.valueAsNumber }))) field.value = String(most);
  };
  return html`<section class="class-limits" aria-label="Who follows">
    <p role="status" data-role="class-count">${following(followers)}, ${copies}.</p>
    <label class="class-limit">
      <span>Most followers</span>
      <input type="number" required min="0" max="1000" step="1" inputmode="numeric" defaultValue=${most} onChange=${change} />
    </label>
    <p class="hint">It ends automatically ${moment(expires)}.</p>
  </section>`;
}

/** The link of a class: short enough to type, as a QR code, with a copy button, and large enough for the back of a room.
 *
 * @param {{follow: FollowOwned}} props
 */
function Link({ follow: { id, title, links: [{ address }, ...others], notice } }) {
  const { host, pathname } = new URL(address);
  // In the form that people read and type: without the scheme, and with a line break only before the name of the class.
  const parts = [host, pathname].map((text) => html`<span>${text}</span>`);
  const code = html`<img src=${addressOf("GET follows/{follow}/qr.svg", { follow: id })} alt=${`QR code of ${address}`} width="200" height="200" />`;
  const large = () => openDialog(title, () => html`<div class="class-large">${code}<p>${parts}</p></div>`, "large");
  // Text to type is between backquotes.
  const withCode = notice?.split("`").map((text, place) => (place % 2 === 0 ? text : html`<code>${text}</code>`));
  return html`<section class="class-link" aria-label="The link">
    <button type="button" class="class-qr" title="Show enlarged" onClick=${large}>${code}</button>
    <div class="class-address">
      <output aria-label="Link" data-role="class-link">${parts}</output>
      <div class="poll-line">
        ${h(CopyButton, { label: "Copy the link", text: address, what: "of the class" })}
        <button type="button" onClick=${large}>Show enlarged</button>
      </div>
      ${withCode && html`<p class="note" data-role="reach">${withCode}</p>`}
      ${others.length > 0 && html`<details>
        <summary>Other addresses</summary>
        <ul>${others.map((other) => html`<li>${other.address}</li>`)}</ul>
      </details>`}
    </div>
  </section>`;
}

/** A poll, or the form for one, and earlier polls.
 *
 * @param {{control: ClassControl, close: () => void}} props
 */
function Asking({ control, close }) {
  const before = useSignal(/** @type {PollKept[]} */ ([]));
  useEffect(() => void (isParticipant || request("GET polls").then((kept) => (before.value = kept), () => {})), []);
  const ask = async (/** @type {PollCreateRequest} */ poll) => {
    const isAsked = await control.ask(poll);
    // The poll is on the page, where the run continues.
    if (isAsked) close();
    return isAsked;
  };
  return html`<section class="class-poll" aria-label="Ask the class">
    ${control.follow.value?.poll ? h(ClassPoll, { control }) : h(PollForm, { ask, action: "Ask the class" })}
    ${before.value.length > 0 && html`<div class="class-before">
      <details>
        <summary>Answered before (${before.value.length})</summary>
        ${h(Answered, { kept: before.value.slice(0, MOST_BEFORE), again: ({ id }) => ask({ kept: id }) })}
      </details>
      <a href=${addressOf("GET polls/answers.csv")} download="">Download all answers as CSV</a>
    </div>`}
  </section>`;
}

/** A choice of lectures, and the button that adds this page to one. */
function AddToLecture() {
  const all = useSignal(/** @type {readonly Pick<LectureSummary, "id"|"title">[]} */ ([NEW]));
  const chosen = useSignal(NEW.id);
  const list = async (/** @type {string|null} */ id) => {
    const found = await request("GET lectures");
    all.value = [...found, NEW];
    chosen.value = id ?? all.value[0].id;
  };
  useEffect(() => void list(null).catch(() => {}), []);
  const add = () => attempt(async () => {
    const item = await itemOfAddress(location.href);
    const { id, title, items, page } = await put(chosen.value, item);
    toast(`Item ${items.length} of ${title}`, { action: { label: "Open the lecture", href: page } });
    await list(id);
  });
  const options = all.value.map(({ id, title }) => ({ value: id, words: title }));
  return html`<section class="class-lecture" aria-label="Add to a lecture">
    <span>Add this page to</span>
    ${h(Select, { label: "Lecture", options, value: chosen.value, choose: (id) => (chosen.value = id) })}
    ${h(Doing, { label: "Add", run: add, "data-role": "add-to-lecture" })}
  </section>`;
}

/**
 * @param {string} id Empty for a new lecture.
 * @param {Record<string, unknown>} item
 */
async function put(id, item) {
  if (id === NEW.id) return request("POST lectures", { body: { title: "My lecture", notes: "", items: [item] } });
  const { title, notes, items } = await request("GET lectures/{lecture}", { lecture: id });
  return request("PUT lectures/{lecture}", { lecture: id, body: { title, notes, items: [...items.map((each) => each.item), item] } });
}
