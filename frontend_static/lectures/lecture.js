/** The page that edits a lecture: its order, a palette of items, and the start. Changes are saved at once. */

import { beginLecture, open } from "../lecturer/leading.js";
import { ClassControl, following, walkOfTab } from "../lecturer/class_control.js";
import { Answered } from "../lecturer/poll.js";
import { clock, clockWords, minutesText, spentOn, time } from "../lecturer/walk.js";
import { addressOf, messageOf, request } from "../shared/api.js";
import { askName } from "../shared/dialog.js";
import { lastOfAddress, part, toast } from "../shared/dom.js";
import { count } from "../shared/format.js";
import { Doing, Loaded, showPage } from "../shared/page.js";
import { NewestRequest } from "../shared/timing.js";
import { h, html, signal, useEffect, useRef } from "../vendor/preact.js";
import { Order } from "./order.js";
import { Palette } from "./palette.js";

/** @import { Item } from "../lecturer/items.js" */
/** @import { Walk } from "../lecturer/walk.js" */
/** @import { LectureItemPublic, LecturePublic, LectureUpdate, PollKept } from "../shared/messages.js" */
/** @import { Entry } from "./order.js" */

/** @typedef {Omit<LecturePublic, "items"> & {items: readonly Entry[]}} Shown */

const EMPTY = "This lecture is empty. Add a lesson, a failure, a session, a comparison or a poll.";
const RUN_MINUTES = 5;
const id = lastOfAddress();
/** Listeners end only with the page. */
const { signal: end } = new AbortController();

/** The lecture, including changes that the server does not have yet. */
const lecture = signal(/** @type {Shown|null} */ (null));
const answered = signal(/** @type {readonly PollKept[]} */ ([]));
let keys = 0;

const saving = new NewestRequest((/** @type {LectureUpdate} */ wish) => request("PUT lectures/{lecture}", { lecture: id, body: wish }), {
  answer: (found, _, isNewest) => isNewest && take(found),
  refused: (error) => toast(messageOf(error), { kind: "error" }),
  lost: (isLost) => (part("disconnected").hidden = !isLost),
}, end);

async function findAnswered() {
  answered.value = await request("GET polls", { lecture: id }).catch(() => []);
}

/** @returns {Shown} The loaded lecture. */
function known() {
  return /** @type {Shown} */ (lecture.value);
}

/** Take over the server's answer: titles, pages, and problems of missing items.
 *
 * @param {LecturePublic} found
 */
function take(found) {
  const before = lecture.value?.items ?? [];
  // An entry keeps its key, so that the focus stays where it is.
  const items = found.items.map((item, place) => ({ ...item, key: before.length === found.items.length ? before[place].key : keys++ }));
  lecture.value = { ...found, items };
  document.title = `${found.title} · pftrack`;
  part("title").textContent = found.title;
}

/**
 * @param {Partial<Shown>} changes
 * @returns {Promise<void>} Resolves when it is saved.
 */
function change(changes) {
  const { title, notes, items } = (lecture.value = { ...known(), ...changes });
  return saving.ask({ title, notes, items: items.map(({ item }) => item) });
}

/** Add an item at the end; title and minutes are guesses until the server has answered.
 *
 * @param {Item} item
 * @param {string} [name]
 * @param {number} [minutes]
 */
function add(item, name, minutes = RUN_MINUTES) {
  // The first key of an item is its kind.
  const [kind] = /** @type {LectureItemPublic["kind"][]} */ (Object.keys(item));
  const title = String(name ?? item.title ?? kind);
  change({ items: [...known().items, { item, kind, title, minutes, key: keys++, page: null, asks: null, problem: null }] });
  toast(`${title} is item ${known().items.length}`);
}

/** @param {Entry} entry */
async function rename(entry) {
  const title = await askName(`Rename ${entry.title}`, entry.title);
  if (title === null) return;
  const renamed = { title, item: { ...entry.item, title } };
  change({ items: known().items.map((each) => (each.key === entry.key ? { ...each, ...renamed } : each)) });
}

/** The whole page, once the lecture is known. */
function Lecture() {
  const { title, notes, items } = known();
  const kept = walkOfTab.get();
  const walk = kept?.lecture === id ? kept : null;
  const note = (/** @type {Entry} */ entry) => {
    const at = walk?.steps.findIndex((step) => step.kind === entry.kind && step.title === entry.title) ?? -1;
    const spent = walk === null || at < 0 ? 0 : spentOn(walk, at, Date.now());
    return spent > 0 ? `took ${time(spent)} last time` : "";
  };
  const entitle = (/** @type {Event & {currentTarget: HTMLInputElement}} */ { currentTarget: field }) =>
    field.reportValidity() && change({ title: field.value.trim() });
  const write = (/** @type {Event & {currentTarget: HTMLTextAreaElement}} */ { currentTarget }) => change({ notes: currentTarget.value });
  return html`
    ${walk?.ended && h(Over, { walk })}
    <div class="lecture-head">
      <div class="lecture-name">
        <label for="lecture-title">Title</label>
        <input type="text" id="lecture-title" required pattern=".*\\S.*" maxlength="200" defaultValue=${title} onChange=${entitle} />
      </div>
      ${h(Ways, { walk: walk?.ended === null ? walk : null, isEmpty: items.length === 0 })}
    </div>
    <div class="lecture-parts">
      <div class="lecture-own">
        <header>
          <h2>Order</h2>
          <p class="lecture-total" role="status">${count(items.length, "item")}, ${minutesText(items.reduce((sum, { minutes }) => sum + minutes, 0))}</p>
        </header>
        ${items.length === 0 && html`<p class="empty">${EMPTY}</p>`}
        ${h(Order, { entries: items, change: (entries) => change({ items: entries }), rename, note })}
        ${answered.value.length > 0 && html`<section aria-label="Polls of this lecture">
          <header><h2>Poll results</h2><a class="button" href=${addressOf("GET polls/answers.csv", { lecture: id })} download="">Download as CSV</a></header>
          ${h(Answered, { kept: answered.value, removed: findAnswered, isOpen: true })}
        </section>`}
        <label for="lecture-notes">Private notes</label>
        <textarea id="lecture-notes" rows="4" maxlength="10000" defaultValue=${notes} onChange=${write}></textarea>
      </div>
      ${h(Palette, { add })}
    </div>
  `;
}

/** @param {{walk: Walk|null, isEmpty: boolean}} props `walk` is an unfinished walk of this tab through the lecture. */
function Ways({ walk, isEmpty }) {
  // Wait for unsaved changes.
  const start = () => change({}).then(() => beginLecture(known()));
  const file = addressOf("GET lectures/{lecture}/file", { lecture: id });
  return html`<div class="row-actions">
    <a class="button" href=${file} download="" title="One small text file, which can be shared">Download</a>
    ${h(Doing, { label: walk ? "Begin again" : "Begin the lecture", run: start, disabled: isEmpty, class: walk ? "" : "primary" })}
    ${walk && html`<button type="button" class="primary" onClick=${() => open(walk)}>Continue with item ${walk.at + 1}</button>`}
  </div>`;
}

/** The class that this tab leads; this page shows it nothing. */
const control = new ClassControl(() => null);

/** After a lecture: the time that it took, and the class, which continues until it is ended.
 *
 * @param {{walk: Walk}} props
 */
function Over({ walk }) {
  const hadClass = useRef(false);
  useEffect(() => void control.find(), []);
  const follow = control.follow.value;
  hadClass.current ||= follow !== null;
  const words = follow === null ? "The class has ended." : `${following(follow.followers)}; the pages of the class stay open until you end it.`;
  const finish = html`<button type="button" class="primary" data-role="end-class" onClick=${() => control.end()}>End for the class</button>`;
  return html`<section class="lecture-over" aria-label="The lecture is over" role="status">
    <h2>The lecture is over</h2>
    <p>It took ${clockWords(clock(walk, Date.now()).whole)}. Each item's time and the poll results are below.</p>
    ${hadClass.current && html`<p class="lecture-class"><span>${words}</span>${follow !== null && finish}</p>`}
  </section>`;
}

async function load() {
  take(await request("GET lectures/{lecture}", { lecture: id }));
  await findAnswered();
  return h(Lecture, {});
}

addEventListener("pageshow", (event) => event.persisted && location.reload());
const unknown = { title: "Lecture not found", action: { label: "All lectures", href: "lectures" } };
showPage("lecture", "lectures", () => h(Loaded, { load, failed: "Couldn't load this lecture", unknown }));
