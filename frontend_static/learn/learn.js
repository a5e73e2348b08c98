/** The overview of all lessons: the course in order, lecturers' lessons, and problems of files that cannot be read. */

import { request } from "../shared/api.js";
import { count } from "../shared/format.js";
import { Loaded, showPage } from "../shared/page.js";
import { PresentationButton } from "../shared/presentation.js";
import { h, html } from "../vendor/preact.js";
import { Progress, stateOf } from "./progress.js";

/** @import { LessonProblem, LessonPublic } from "../shared/messages.js" */

const LEAD =
  "Twelve steps from an average to a colour tracker. Each first asks for your prediction, then shows the result, and explains how far off it " +
  "was and why. Your progress stays in this browser.";
const NO_LESSONS = "No lessons are installed; pftrack was installed without its course.";

const SIGNS = { open: "", skipped: "–", right: "✓", wrong: "✗" };
const STANDING = { open: "not answered yet", skipped: "viewed without an answer", right: "answered correctly", wrong: "answered, but wrong" };

const progress = new Progress();

/** @param {{all: LessonPublic[], problems: LessonProblem[]}} props */
function Overview({ all, problems }) {
  const course = all.filter(({ number }) => number > 0);
  const others = all.filter(({ number }) => number === 0);
  const done = progress.done(course);
  const next = course.find(({ id }) => progress.of(id) === null);
  const cards = (/** @type {LessonPublic[]} */ some) => some.map((lesson) => h(Card, { key: lesson.id, lesson }));
  return html`
    <header class="learn-head">
      <div><h2>The course</h2><p class="hint">${LEAD}</p></div>
      ${next && html`<a class="button primary" href=${address(next)} data-role="continue">
        ${done === 0 ? "Begin with" : "Continue with"} ${next.number} · ${next.title}
      </a>`}
    </header>
    <p class="learn-progress">
      <progress max=${Math.max(1, course.length)} value=${done} aria-label="Lessons answered"></progress>
      <span>${done} of ${course.length} done</span>
    </p>
    ${course.length === 0 ? html`<p class="empty">${NO_LESSONS}</p>` : html`<ol class="course">${cards(course)}</ol>`}
    ${others.length + problems.length > 0 && html`<h2>Other lessons</h2>`}
    ${others.length > 0 && html`<ul class="course">${cards(others)}</ul>`}
    ${problems.length > 0 && html`<section class="learn-problems" aria-label="Lessons that cannot be read">
      <h3>${count(problems.length, "lesson")} that cannot be read</h3>
      <ul>${problems.map(({ origin, line, message }) => html`<li><b>${line === 0 ? origin : `${origin}, line ${line}`}</b>: ${message}</li>`)}</ul>
    </section>`}
  `;
}

/** @param {{lesson: LessonPublic}} props */
function Card({ lesson }) {
  const { id, number, title, origin, uses, problem, kind, minutes } = lesson;
  const state = stateOf(progress.of(id));
  const words = [STANDING[state], `${minutes} min`, kind === "scenario" && "a run to watch", origin && `from ${origin}`];
  const titles = uses.map((each) => each.title);
  // An experiment that uses the idea twice has one link here.
  const used = titles.flatMap((each, index) =>
    titles.indexOf(each) === index ? [index > 0 && ", ", html`<a href=${`${address(lesson)}#use-${index + 1}`}>${each}</a>`] : []);
  return html`<li class="lesson-card" data-lesson=${id} data-state=${state}>
    <span class="lesson-sign" aria-hidden="true">${SIGNS[state]}</span>
    <div class="row-words">
      <a class="row-title" href=${address(lesson)}>${number > 0 ? `${number} · ${title}` : title}</a>
      <span class="hint">${words.filter(Boolean).join(" · ")}</span>
      ${problem !== null && html`<span class="wrong">${problem}</span>`}
      ${used.length > 0 && html`<span class="hint">Used in ${used}</span>`}
    </div>
  </li>`;
}

/** @param {{id: string}} lesson */
function address({ id }) {
  return `learn/${encodeURIComponent(id)}`;
}

async function load() {
  const { lessons: all, problems } = await request("GET lessons");
  return h(Overview, { all, problems });
}

// The person returns from an answered lesson.
addEventListener("pageshow", (event) => event.persisted && location.reload());
showPage("learn", "learn", () => h(Loaded, { load, failed: "Couldn't load the lessons" }), h(PresentationButton, {}));
