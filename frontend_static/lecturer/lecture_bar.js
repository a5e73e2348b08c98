/**
 * The line of a lecture on each page that it leads to: which item of how many, what comes, the clock, and the ways on. The keys
 * that presenters' remote controls send, page up and page down, are Previous and Next. The class comes along, if it sees the page.
 */

import { api } from "../shared/api.js";
import { dialogIsOpen } from "../shared/dialog.js";
import { fill, h, setText } from "../shared/dom.js";
import { icon } from "../shared/icons.js";
import { isParticipant } from "../shared/participant.js";
import { isPresenting } from "../shared/presentation.js";
import { PollView } from "./poll.js";
import { asked, clock, clockWords, end, go, hostOf, keepWalk, opened, pageOf, walkOfTab } from "./walk.js";

/** @import { ClassControl } from "./class_control.js" */
/** @import { Walk } from "./walk.js" */

const SECOND_MS = 1000;
const USES_PAGE_KEYS = "input:not([type=checkbox], [type=radio]), textarea, select, [contenteditable]";
/** A session that has a name; one that is new begins anew wherever it is opened. */
const SESSION = /^session\/(?!new)([^/?#]+)/;

/**
 * Show the line, where this tab walks through a lecture.
 *
 * @param {ClassControl} control
 * @param {AbortSignal} signal
 */
export function lectureBar(control, signal) {
  const walk = isParticipant ? null : walkOfTab();
  if (walk !== null && walk.ended === null) new LectureBar(walk, control, signal).show();
}

class LectureBar {
  #walk;
  #control;
  #signal;
  #isLeaving = false;
  #previous = h(
    "button",
    { type: "button", class: "quiet", title: "Previous (page up)", on: { click: () => this.#step(-1) } },
    icon("previous"),
    h("span", { class: "wide-only" }, "Previous"),
  );
  #words = h("span", {});
  #next = h("button", { type: "button", class: "primary", title: "Next (page down)", data: { role: "lecture-next" }, on: { click: () => this.#onward() } });
  #count = h("span", { class: "lecture-count" });
  #place = h("a", { class: "lecture-place" });
  #coming = h("span", { class: "hint lecture-coming" });
  #whole = h("span", { class: "lecture-clock" });
  #one = h("span", { class: "lecture-clock" });
  #hands = h("aside", { class: "lead-poll", "aria-label": "A show of hands", hidden: true });

  /**
   * @param {Walk} walk
   * @param {ClassControl} control
   * @param {AbortSignal} signal
   */
  constructor(walk, control, signal) {
    this.#walk = walk;
    this.#control = control;
    this.#signal = signal;
  }

  show() {
    fill(this.#next, this.#words, icon("next"));
    const clocks = h("span", { class: "lecture-clocks", role: "timer", "aria-label": "Clock" }, this.#one, this.#whole);
    const line = h("nav", { class: "lecture-bar", "aria-label": "Lecture" }, this.#previous, this.#count, this.#place, this.#coming, clocks, this.#next);
    const top = document.querySelector(".top");
    // Presented it stands in the page's first line, whose words it says as well. It is not moved in vain: a click would be lost.
    const stand = () => {
      if (line.isConnected && (line.parentElement === top) === isPresenting()) return;
      if (isPresenting()) top?.prepend(line);
      else top?.after(line);
    };
    const presenting = new MutationObserver(stand);
    presenting.observe(document.documentElement, { attributeFilter: ["data-presenting"] });
    stand();
    document.body.append(this.#hands);
    this.#control.on(["follow"], () => this.#look(), this.#signal);
    document.addEventListener("keydown", (event) => this.#press(event), { signal: this.#signal });
    const ticking = setInterval(() => this.#tick(), SECOND_MS);
    this.#signal.addEventListener("abort", () => {
      clearInterval(ticking);
      presenting.disconnect();
      line.remove();
      this.#hands.remove();
    });
    this.#look();
  }

  /** Draw where the lecture stands, and ask what is to be asked here. */
  #look() {
    const { steps, at } = this.#walk;
    const step = steps[at];
    this.#previous.disabled = at === 0;
    setText(this.#count, `${at + 1} of ${steps.length}`);
    setText(this.#place, step.title);
    this.#place.href = pageOf(this.#walk);
    this.#place.title = `${this.#walk.title}: go to this item`;
    const after = steps[at + 1];
    setText(this.#coming, after ? `then ${after.title}` : "the last one");
    setText(this.#words, this.#canReveal ? "Reveal" : this.#goesOn);
    this.#ask();
    this.#tick();
  }

  get #goesOn() {
    return this.#walk.at + 1 < this.#walk.steps.length ? "Next" : "Finish";
  }

  /** Whether the class answers what this step asks. */
  get #canReveal() {
    const { isHere, follow } = this.#control;
    return isHere && this.#walk.steps[this.#walk.at].asks !== null && follow?.poll?.revealed === false;
  }

  #tick() {
    const { whole, step } = clock(this.#walk, Date.now());
    for (const [element, clocked, what] of /** @type {const} */ ([[this.#one, step, "this"], [this.#whole, whole, "all"]])) {
      setText(element, `${what} ${clockWords(clocked)}`);
      element.toggleAttribute("data-over", clocked.taken > clocked.planned);
    }
  }

  /** Ask the class once; where nobody follows, the question stands there for a show of hands. */
  #ask() {
    const { asks } = this.#walk.steps[this.#walk.at];
    const { follow, isHere } = this.#control;
    this.#hands.hidden = true;
    if (asks === null || (follow !== null && !isHere)) return;
    if (follow === null) {
      if (asks.question !== null && asks.answers !== null) this.#show(asks.question, asks.answers);
    } else if (!this.#walk.asked[this.#walk.at]) {
      this.#keep(asked(this.#walk));
      this.#control.ask(asks);
    }
  }

  /**
   * @param {string} question
   * @param {string[]} answers
   */
  #show(question, answers) {
    const view = new PollView({ vote: null });
    view.show({ id: question, question, answers, votes: null, counts: null, revealed: false, lesson: null });
    fill(this.#hands, view.element);
    this.#hands.hidden = false;
  }

  /** What page down does: first what was asked is revealed, then the lecture goes on. */
  async #onward() {
    if (this.#canReveal) {
      await this.#control.reveal();
      return;
    }
    if (this.#walk.at + 1 < this.#walk.steps.length) await this.#step(1);
    else this.#finish();
  }

  /** @param {number} by */
  async #step(by) {
    if (this.#isLeaving) return;
    const { isHere, follow } = this.#control;
    if (isHere && follow?.poll?.revealed) await this.#control.withdraw();
    const before = hostOf(this.#walk);
    const here = location.href.replace(document.baseURI, "");
    const left = SESSION.test(here) && this.#walk.steps[before].kind === "session" ? opened(this.#walk, here) : this.#walk;
    this.#keep(go(left, by, Date.now()));
    if (hostOf(this.#walk) === before) {
      this.#look();
      return;
    }
    this.#isLeaving = true;
    await this.#forgetEnded();
    this.#control.takeAlong();
    location.assign(pageOf(this.#walk));
  }

  /** What was begun for a step may have been ended since. */
  async #forgetEnded() {
    const session = SESSION.exec(pageOf(this.#walk))?.[1];
    if (session === undefined) return;
    try {
      await api.session(decodeURIComponent(session));
    } catch {
      this.#keep(opened(this.#walk, null));
    }
  }

  #finish() {
    this.#isLeaving = true;
    this.#keep(end(this.#walk, Date.now()));
    location.assign(`lectures/${encodeURIComponent(this.#walk.lecture)}`);
  }

  /** @param {Walk} walk */
  #keep(walk) {
    this.#walk = walk;
    keepWalk(walk);
  }

  /** @param {KeyboardEvent} event */
  #press(event) {
    const { key, target, ctrlKey, metaKey, altKey, shiftKey, defaultPrevented } = event;
    if (defaultPrevented || ctrlKey || metaKey || altKey || shiftKey || !this.#takes(target)) return;
    if (this.#turn(key)) event.preventDefault();
  }

  /**
   * Whether page up and page down are the lecture's: whoever presents has a remote control in the hand, and else what has the
   * focus may need them.
   *
   * @param {EventTarget|null} target
   */
  #takes(target) {
    // The scene keeps for itself what it needs of its keys.
    if (!(target instanceof Element) || target instanceof HTMLIFrameElement) return true;
    if (isPresenting()) return target.closest("input[type=text], input[type=number], input[type=search], textarea, [contenteditable]") === null;
    return target.closest(USES_PAGE_KEYS) === null && !scrolls(target);
  }

  /**
   * @param {string} key
   * @returns {boolean} Whether it turned a page.
   */
  #turn(key) {
    if (dialogIsOpen() || (key !== "PageDown" && key !== "PageUp")) return false;
    if (key === "PageDown") this.#onward();
    else if (this.#walk.at > 0) this.#step(-1);
    return true;
  }
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
