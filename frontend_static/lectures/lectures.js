/** All lectures, and the stored polls. */

import { addressOf, request } from "../shared/api.js";
import { beginLecture } from "../lecturer/leading.js";
import { Answered } from "../lecturer/poll.js";
import { minutesText } from "../lecturer/walk.js";
import { confirmLoss } from "../shared/dialog.js";
import { attempt, FileButton, IconButton } from "../shared/dom.js";
import { count, moment } from "../shared/format.js";
import { Loaded, showPage } from "../shared/page.js";
import { h, html, signal } from "../vendor/preact.js";

/** @import { LecturePublic, LectureSummary, PollKept } from "../shared/messages.js" */

const LEAD =
  "A lecture puts lessons, failures, sessions, comparisons and polls in order. While you present, Next opens the next item, the class " +
  "comes along, and a clock shows how long each item takes.";
const EMPTY = "No lectures yet. Create one, or open a shared file.";
const UNANSWERED = "No polls yet. Answers of classes are kept here without names.";

const known = signal(/** @type {{all: LectureSummary[], answered: PollKept[]}} */ ({ all: [], answered: [] }));

async function look() {
  const [all, answered] = await Promise.all([request("GET lectures"), request("GET polls")]);
  known.value = { all, answered };
}

/** The whole page, once the lectures are known. */
function Lectures() {
  const { all, answered } = known.value;
  return html`
    <section aria-label="Lectures">
      <header>
        <div><h2>Lectures</h2><p class="hint">${LEAD}</p></div>
        ${h(Ways, {})}
      </header>
      ${all.length > 0 ? html`<ul class="rows">${all.map((lecture) => h(Row, { key: lecture.id, lecture }))}</ul>` : html`<p class="empty">${EMPTY}</p>`}
    </section>
    <section aria-label="Polls">
      <header>
        <h2>Poll results</h2>
        ${answered.length > 0 && html`<a class="button" href=${addressOf("GET polls/answers.csv")} download="">Download as CSV</a>`}
      </header>
      ${answered.length > 0 ? h(Answered, { kept: answered, removed: look }) : html`<p class="empty">${UNANSWERED}</p>`}
    </section>
  `;
}

/** Buttons that create or open a lecture. */
function Ways() {
  const made = async (/** @type {() => Promise<LecturePublic>} */ make) => {
    const lecture = await attempt(make);
    if (lecture !== undefined) location.assign(lecture.page);
  };
  const take = (/** @type {File[]} */ [file]) => made(() => request("POST lectures/import", { body: new Blob([file], { type: "text/markdown" }) }));
  const opened = { name: "lecture", label: "Open a file", words: "Open a file", title: "Open a shared lecture file", accept: ".md,text/markdown", take };
  return html`<div class="row-actions">
    ${h(FileButton, opened)}
    <button type="button" class="primary" onClick=${() => made(() => request("POST lectures", { body: { title: "New lecture" } }))}>New lecture</button>
  </div>`;
}

/** @param {{lecture: LectureSummary}} props */
function Row({ lecture: { id, title, count: items, minutes, updated, page } }) {
  const start = async () => {
    const lecture = await attempt(() => request("GET lectures/{lecture}", { lecture: id }));
    if (lecture !== undefined) beginLecture(lecture);
  };
  const remove = async () => {
    const text = `${title} is deleted permanently, unless you downloaded it. Its poll results stay.`;
    const deleted = () => request("DELETE lectures/{lecture}", { lecture: id }).then(look);
    if (await confirmLoss({ title: "Delete this lecture?", text, action: "Delete it" })) await attempt(deleted);
  };
  return html`<li class="row" data-lecture=${id}>
    <div class="row-words">
      <a class="row-title" href=${page}>${title}</a>
      <span class="hint">${count(items, "item")}, ${minutesText(minutes)}, ${moment(updated)}</span>
    </div>
    <div class="row-actions">
      <button type="button" class="primary" disabled=${items === 0} onClick=${start}>Begin</button>
      <a class="button" href=${page}>Edit</a>
      <a class="button" href=${addressOf("GET lectures/{lecture}/file", { lecture: id })} download="" aria-label=${`Download ${title}`}>Download</a>
      ${h(IconButton, { name: "trash", title: `Delete ${title}`, run: remove })}
    </div>
  </li>`;
}

async function load() {
  await look();
  return h(Lectures, {});
}

// A page from the browser's cache shows an old list; load it again.
addEventListener("pageshow", (event) => event.persisted && attempt(look));
showPage("lectures", "lectures", () => h(Loaded, { load, failed: "Couldn't load the lectures" }));
