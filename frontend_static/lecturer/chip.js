/**
 * A class on its lecturer's page: the chip in the header, "Follow me" or how many follow; what it opens, which is the link with its
 * QR code, a poll, the limits and the end; and a poll of the class over the page. What the page shows can be added to a lecture
 * here as well.
 */

import { CopyButton } from "../shared/copy.js";
import { confirmLoss, dialogIsOpen, openDialog } from "../shared/dialog.js";
import { elementOf, h as element } from "../shared/dom.js";
import { moment } from "../shared/format.js";
import { Icon } from "../shared/icons.js";
import { Doing } from "../shared/page.js";
import { isParticipant } from "../shared/participant.js";
import { isPresenting } from "../shared/presentation.js";
import { attempt, toast } from "../shared/toast.js";
import { effect, h, html, render, signal, useEffect, useSignal } from "../vendor/preact.js";
import { follows, lectures, polls } from "./api.js";
import { following } from "./class_control.js";
import { itemOfAddress } from "./items.js";
import { lectureLine } from "./lecture_line.js";
import { Answered, ClassPoll, PollForm } from "./poll.js";

/** @import { FollowOwned, LectureSummary, PollCreateRequest, PollKept } from "../shared/messages.js" */
/** @import { Signal, VNode } from "../vendor/preact.js" */
/** @import { ClassControl } from "./class_control.js" */

/** @typedef {"folded"|"whole"|"staged"} Size How large a poll is: a line of the page, over its lower edge, or all of it where it is presented. */

const WHAT =
  "Everybody who opens a short link sees what you show here: the same frame, the same parameters, read only. " +
  "No name is asked for. The server keeps how many gave which answer in a poll.";
const MOST_BEFORE = 20;
const NEW = { id: "", title: "a new lecture" };

/**
 * @param {ClassControl} control
 * @param {AbortSignal} end Takes away what stands on the page besides.
 * @returns {HTMLButtonElement}
 */
export function followChip(control, end) {
  leadPoll(control, end);
  lectureLine(control, end);
  return elementOf(h(FollowChip, { control }));
}

/** @param {{control: ClassControl}} props */
function FollowChip({ control }) {
  const [follow, isHere] = [control.follow.value, control.isHere.value];
  const [words, title] = wordsOf(follow, isHere);
  return html`<button
    type="button" class="follow-chip" aria-haspopup="dialog" title=${title} disabled=${follow === null && !control.mayBegin.value}
    data-leads=${follow !== null || null} data-elsewhere=${(follow !== null && !isHere) || null} onClick=${() => openClassDialog(control)}
  >
    ${h(Icon, { name: "class" })}<span class=${follow === null ? "wide-only" : ""}>${words}</span>
  </button>`;
}

/**
 * @param {FollowOwned|null} follow
 * @param {boolean} isHere
 */
function wordsOf(follow, isHere) {
  if (follow === null) return ["Follow me", "Show this page to a class, which opens a short link; or add it to a lecture"];
  const { followers, title } = follow;
  if (isHere) return [following(followers), "The class sees this page"];
  return [followers === 1 ? "1 sees another page" : `${followers} see another page`, `The class sees something else: ${title}`];
}

/**
 * Keep the poll on the page. What is asked, and what is revealed, is there to be seen; presented, what is revealed takes all of the
 * page, until the next key puts it back to its place.
 *
 * @param {ClassControl} control
 * @param {AbortSignal} end
 */
function leadPoll(control, end) {
  const size = signal(/** @type {Size} */ ("whole"));
  let before = /** @type {string|null} */ (null);
  effect(() => {
    const { id = "", revealed = false } = control.follow.value?.poll ?? {};
    const now = control.follow.value && `${id} ${revealed}`;
    // What was revealed on the page before has been seen.
    if (now !== before) size.value = revealed && before !== null ? "staged" : "whole";
    before = now;
  });
  document.addEventListener("keydown", (event) => {
    if (size.value !== "staged" || !isPresenting() || dialogIsOpen() || isForBrowser(event)) return;
    // It was for the result; the next one is for the page again.
    event.preventDefault();
    event.stopImmediatePropagation();
    size.value = "folded";
  }, { capture: true, signal: end });
  const poll = elementOf(h(LeadPoll, { control, size }));
  (document.querySelector(".top") ?? document.body.firstElementChild)?.after(poll);
  end.addEventListener("abort", () => poll.remove());
}

/** @param {{control: ClassControl, size: Signal<Size>}} props */
function LeadPoll({ control, size }) {
  const isFolded = size.value === "folded";
  const turn = () => (size.value = isFolded ? "whole" : "folded");
  const fold = html`<button type="button" class="quiet" data-role="fold" aria-expanded=${String(!isFolded)} onClick=${turn}>
    ${isFolded ? "Unfold" : "Fold"}
  </button>`;
  return html`<aside
    class="lead-poll" aria-label="The class is asked" data-folded=${isFolded || null} data-staged=${size.value === "staged" || null}
  >
    ${h(ClassPoll, { control, tools: fold })}
  </aside>`;
}

/**
 * Whether a key changes which element has the focus, presses the button that has it, or is a part of another key.
 *
 * @param {KeyboardEvent} event
 */
function isForBrowser({ key, target, ctrlKey, metaKey, altKey }) {
  if (ctrlKey || metaKey || altKey || ["Tab", "Shift"].includes(key)) return true;
  return (key === " " || key === "Enter") && target instanceof Element && target.closest(".lead-poll button") !== null;
}

/** @param {ClassControl} control */
function openClassDialog(control) {
  show("A class that follows", (close) => h(Sheet, { control, close }), "wide");
}

/**
 * Show a component in a dialog until that is closed.
 *
 * @param {string} title
 * @param {(close: () => void) => VNode} content
 * @param {"wide"|"large"} size
 */
function show(title, content, size) {
  const place = element("div", { class: "made" });
  const dialog = openDialog(title, (close) => {
    render(content(close), place);
    return [place];
  });
  dialog.classList.add(size);
  dialog.addEventListener("close", () => render(null, place));
}

/** @param {{control: ClassControl, close: () => void}} props */
function Sheet({ control, close }) {
  const follow = control.follow.value;
  const mayBegin = control.mayBegin.value;
  const isOver = follow === null && !mayBegin;
  useEffect(() => {
    if (isOver) close();
  }, [isOver]);
  return html`
    <div class="class-sheet">${follow === null ? h(Begin, { control }) : h(Running, { key: follow.id, control, follow, close })}</div>
    ${mayBegin && h(AddToLecture, {})}
  `;
}

/**
 * Before a class begins: what it is, and the classes that there are already.
 *
 * @param {{control: ClassControl}} props
 */
function Begin({ control }) {
  const others = useSignal(/** @type {FollowOwned[]} */ ([]));
  useEffect(() => void follows.all().then((all) => (others.value = all), () => {}), []);
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

/**
 * Who follows, who tries something alone, and how many may follow.
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

/**
 * The link of a class: short enough to be typed, as a QR code, to be copied, and large enough for the back of a room.
 *
 * @param {{follow: FollowOwned}} props
 */
function Link({ follow: { id, title, links: [{ address }, ...others], notice } }) {
  const { host, pathname } = new URL(address);
  // As it is read and typed: without what all begin with, and broken nowhere but before the name of the class.
  const parts = [host, pathname].map((text) => html`<span>${text}</span>`);
  const code = html`<img src=${follows.qrAddress(id)} alt=${`QR code of ${address}`} width="200" height="200" />`;
  const large = () => show(title, () => html`<div class="class-large">${code}<p>${parts}</p></div>`, "large");
  // What is to be typed stands between backquotes.
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

/**
 * A poll, or the form for one, and what classes were asked before.
 *
 * @param {{control: ClassControl, close: () => void}} props
 */
function Asking({ control, close }) {
  const lesson = control.shown.value?.lesson ?? null;
  const before = useSignal(/** @type {PollKept[]} */ ([]));
  useEffect(() => void (isParticipant || polls.all().then((kept) => (before.value = kept), () => {})), []);
  const ask = async (/** @type {PollCreateRequest} */ poll) => {
    const isAsked = await control.ask(poll);
    // What is asked stands on the page, where the run goes on.
    if (isAsked) close();
    return isAsked;
  };
  const ofLesson = html`<button type="button" data-role="ask-lesson" onClick=${() => ask({ lesson })}>Ask the question of this lesson</button>`;
  return html`<section class="class-poll" aria-label="Ask the class">
    ${lesson !== null && ofLesson}
    ${control.follow.value?.poll ? h(ClassPoll, { control }) : h(PollForm, { ask, action: "Ask the class" })}
    ${before.value.length > 0 && html`<div class="class-before">
      <details>
        <summary>Answered before (${before.value.length})</summary>
        ${h(Answered, { kept: before.value.slice(0, MOST_BEFORE), again: ({ id }) => ask({ kept: id }) })}
      </details>
      <a href=${polls.csvAddress()} download="">Download all answers as CSV</a>
    </div>`}
  </section>`;
}

/** A choice of lectures, and the button that adds this page to one. */
function AddToLecture() {
  const all = useSignal(/** @type {readonly Pick<LectureSummary, "id"|"title">[]} */ ([NEW]));
  const chosen = useSignal(NEW.id);
  const list = async (/** @type {string|null} */ id) => {
    const found = await lectures.all();
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
  const choose = (/** @type {Event & {currentTarget: HTMLSelectElement}} */ { currentTarget }) => (chosen.value = currentTarget.value);
  return html`<section class="class-lecture" aria-label="Add to a lecture">
    <span>Add this page to</span>
    <select aria-label="Lecture" value=${chosen.value} onChange=${choose}>
      ${all.value.map(({ id, title }) => html`<option key=${id} value=${id}>${title}</option>`)}
    </select>
    ${h(Doing, { label: "Add", run: add, "data-role": "add-to-lecture" })}
  </section>`;
}

/**
 * @param {string} id Empty for a new one.
 * @param {Record<string, unknown>} item
 */
async function put(id, item) {
  if (id === NEW.id) return lectures.add({ title: "My lecture", notes: "", items: [item] });
  const { title, notes, items } = await lectures.get(id);
  return lectures.change(id, { title, notes, items: [...items.map((each) => each.item), item] });
}
