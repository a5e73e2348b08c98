/**
 * Holding a lecture: how it begins or goes on, and its line on each page that it leads to: which item of how many, what comes, the
 * clock, and the ways on. N, and the keys that presenters' remote controls send, page up and page down, are Previous and Next.
 * The class comes along, if it sees the page.
 */

import { api } from "../shared/api.js";
import { dialogIsOpen } from "../shared/dialog.js";
import { elementOf } from "../shared/dom.js";
import { Icon } from "../shared/icons.js";
import { isParticipant } from "../shared/participant.js";
import { isPresenting, isTyping, presentNext } from "../shared/presentation.js";
import { toast } from "../shared/toast.js";
import { computed, effect, h, html, signal } from "../vendor/preact.js";
import { takeClassAlong } from "./class_control.js";
import { Poll } from "./poll.js";
import { asked, begin, clock, clockWords, end, go, hostOf, opened, pageOf, walkOfTab } from "./walk.js";

/** @import { ClassControl } from "./class_control.js" */
/** @import { Walk } from "./walk.js" */

const SECOND_MS = 1000;
/** What page up and page down are for where they are not the lecture's. */
const USES_PAGE_KEYS = "input:not([type=checkbox], [type=radio]), textarea, select, [contenteditable]";
/** A presenter has a remote control in the hand, so all else leaves them to the lecture. */
const IS_WRITTEN_IN = "input[type=text], input[type=number], input[type=search], textarea, [contenteditable]";
const now = signal(Date.now());
/** A session that has a name; one that is new begins anew wherever it is opened. */
const SESSION = /^session\/(?!new)([^/?#]+)/;

/**
 * Show the first item.
 *
 * @param {Parameters<typeof begin>[0]} lecture
 */
export function beginLecture(lecture) {
  const walk = begin(lecture, Date.now());
  if (walk === null) toast("There is nothing to show yet: add a lesson, a failure, a session or a comparison.", { kind: "error" });
  else open(walk);
}

/**
 * Show the item at which the lecturer left, presented, to the class of this tab as well.
 *
 * @param {Walk} walk
 */
export function open(walk) {
  walkOfTab.set(walk);
  takeClassAlong();
  presentNext();
  location.assign(pageOf(walk));
}

/**
 * Show the line, where this tab walks through a lecture.
 *
 * @param {ClassControl} control
 * @param {AbortSignal} ends Takes it away.
 */
export function lectureLine(control, ends) {
  const walk = isParticipant ? null : walkOfTab.get();
  if (walk === null || walk.ended !== null) return;
  const held = new Held(walk, control);
  const [line, hands] = [elementOf(h(Line, { held })), elementOf(h(ShowOfHands, { held }))];
  const top = document.querySelector(".top");
  // Presented it stands in the page's first line, whose words it says as well, and which may just be filled.
  effect(() => {
    const isFirst = isPresenting();
    queueMicrotask(() => (isFirst ? top?.prepend(line) : top?.after(line)));
  });
  effect(() => held.ask());
  document.body.append(hands);
  // On its page N is a branch or the next lesson: the lecture hears it first. The page keys are first those of a list or a figure.
  document.addEventListener("keydown", (event) => event.key.toLowerCase() === "n" && held.press(event), { capture: true, signal: ends });
  document.addEventListener("keydown", (event) => held.press(event), { signal: ends });
  setInterval(() => (now.value = Date.now()), SECOND_MS);
  ends.addEventListener("abort", () => [line, hands].forEach((element) => element.remove()));
}

/** The lecture as it is held on this page. */
class Held {
  #control;
  #isLeaving = false;
  walk;
  step = computed(() => this.walk.value.steps[this.walk.value.at]);
  isLast = computed(() => this.walk.value.at + 1 === this.walk.value.steps.length);
  /** Whether what the class was asked is revealed; nothing where it is not asked anything. */
  isRevealed = computed(() => (this.#control.isHere.value ? this.#control.follow.value?.poll?.revealed : undefined));
  /** Whether the class answers what this step asks. */
  canReveal = computed(() => this.step.value.asks !== null && this.isRevealed.value === false);
  /** What is asked where nobody follows. */
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

  /** Ask the class once what the step asks. */
  ask() {
    const { asks, asked: isAsked } = this.step.value;
    if (asks === null || isAsked || this.#isLeaving || !this.#control.isHere.value) return;
    this.walk.value = asked(this.walk.value);
    this.#control.ask(asks);
  }

  /** What page down does: first what was asked is revealed, then the lecture goes on. */
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

  /** What was begun for a step may have been ended since. */
  async #forgetEnded() {
    const session = SESSION.exec(pageOf(this.walk.value))?.[1];
    if (session === undefined) return;
    try {
      await api.session(decodeURIComponent(session));
    } catch {
      this.walk.value = opened(this.walk.value, null);
    }
  }

  #finish() {
    this.#isLeaving = true;
    this.walk.value = end(this.walk.value, Date.now());
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

/**
 * Whether a key is the lecture's: what has the focus may need it. The scene keeps for itself what it needs of its keys.
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
