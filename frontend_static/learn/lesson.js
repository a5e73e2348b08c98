/** The page of a lesson: text, figure or run, question; and the class that may follow it. */

import { ClassControl, FollowChip } from "../lecturer/class_control.js";
import { addressOf, here, messageOf, request, START } from "../shared/api.js";
import { openKeys } from "../shared/dialog.js";
import { lastOfAddress, Neighbours, part } from "../shared/dom.js";
import { END_FORK, endFork, Loaded, showPage } from "../shared/page.js";
import { isPlain, isTyping, PresentationButton, PrintButton } from "../shared/presentation.js";
import { linkTo } from "../shared/share_link.js";
import { after } from "../shared/timing.js";
import { isFollower, isParticipant } from "../shared/visitor.js";
import { effect, h, html, render, signal, untracked, useEffect, useMemo, useRef, useSignal } from "../vendor/preact.js";
import { Course, Question, written } from "./course.js";
import { checked, Mark } from "./numbers.js";
import { Demonstration, LessonRun, Stage } from "./stage.js";

/** @import { ChecksPublic, LessonDetail, ScenarioPublic } from "../shared/messages.js" */

/** @type {readonly [keys: string, what: string][]} */
const KEYS = [
  ["N", "Next lesson"],
  ["P", "Previous lesson"],
  ["D", "New draw"],
  ["F", "Present in large type; escape ends it"],
  ["pageup pagedown", "In a lecture: previous and next item (next also by N)"],
  ["?", "These keys"],
];
const ARROWS = "The arrow keys move the focused slider or line in the figure. A shown run has the keys of a session.";
const CHECKED_AGAIN_MS = 700;
/** Fragment that names a use of the lesson, so that the browser's Back works. */
const USE = /^#use-(\d+)$/;
const hash = signal(location.hash);
/** The class that may follow this lesson, once it is known. */
const classControl = signal(/** @type {ClassControl|null} */ (null));

/** @param {{course: Course}} props */
function Lesson({ course }) {
  const { lesson, stage, answer } = course;
  const found = USE.exec(hash.value);
  const use = found ? lesson.uses[Number(found[1]) - 1] : undefined;
  const isUsed = use !== undefined && use.problem === null;
  const isLocked = answer.value === null;
  const notice = html`<p class="lesson-notice" data-part="notice"><span ...${written(lesson.notice)}></span></p>`;
  return html`
    <article class="lesson-text" data-part="text" tabindex="0" aria-label="Idea">${h(Text, { lesson })}</article>
    <section class="lesson-stage" data-part="own" aria-label="Figure" hidden=${isUsed}>
      <h2 class="visually-hidden">Figure</h2>
      ${h(Stage, { stage, isLocked, notice })}
    </section>
    ${isUsed && h(Use, { key: hash.value, use, course })}
    <section class="lesson-question" data-part="question" data-stage=${stageOf(answer.value)} aria-label="Question" hidden=${isUsed}>
      ${h(Question, { course })}
    </section>
  `;
}

/** @param {import("./stage.js").Answer} answer */
function stageOf(answer) {
  if (answer === null) return "asked";
  if (typeof answer === "string") return "skipped";
  return answer.right ? "right" : "wrong";
}

/** @param {{lesson: LessonDetail}} props */
function Text({ lesson }) {
  const { id, idea, tries, uses, origin, checks } = lesson;
  const notebook = addressOf("GET lessons/{lesson}/notebook.ipynb", { lesson: id });
  const tried = tries.map((each) => html`<li ...${written(each)}></li>`);
  return html`
    <h2 class="visually-hidden">Idea</h2>
    <div class="idea" ...${written(idea)}></div>
    ${tries.length > 0 && html`<section class="tries"><h2>Try</h2><ul>${tried}</ul></section>`}
    ${uses.length > 0 && html`<details class="lesson-fold uses" data-part="uses">
      <summary>Where it is used (${uses.length})</summary><ul>${uses.map(entry)}</ul>
    </details>`}
    ${checks.length > 0 && h(Checks, { lesson })}
    ${!isParticipant && html`<p class="hint"><a href=${notebook} download=${`${id}.ipynb`}>Notebook of this lesson</a></p>`}
    ${origin && html`<p class="hint">From ${origin}</p>`}
  `;
}

/**
 * @param {ScenarioPublic} use
 * @param {number} index
 */
function entry({ words, title, problem }, index) {
  const text = html`<span ...${written(words)}></span>`;
  if (problem !== null) return html`<li>${text} <span class="hint">${problem}</span></li>`;
  return html`<li><a href=${here(`use-${index + 1}`)}>${title}</a>: ${text}</li>`;
}

/** The lesson's checks: computed on the server when they are unfolded, each with its exact value.
 *
 * @param {{lesson: LessonDetail}} props
 */
function Checks({ lesson: { id, checks } }) {
  const found = useSignal(/** @type {ChecksPublic|null} */ (null));
  const problem = useSignal("");
  const isAsked = useRef(false);
  const follow = async (/** @type {Event & {currentTarget: HTMLDetailsElement}} */ { currentTarget: { open } }) => {
    if (!open || isAsked.current) return;
    isAsked.current = true;
    problem.value = "";
    try {
      while (found.value === null || found.value.done < found.value.total) {
        if (found.value !== null) await after(CHECKED_AGAIN_MS);
        found.value = await request("GET lessons/{lesson}/checks", { lesson: id });
      }
    } catch (error) {
      isAsked.current = false;
      problem.value = messageOf(error);
    }
  };
  const { done, total, results } = found.value ?? { done: 0, total: 0, results: [] };
  const passed = results.filter((each) => each.passed).length;
  const came = passed === total ? `All ${total} checks pass` : `${passed} of ${total} checks pass`;
  return html`<details class="lesson-fold" onToggle=${follow}>
    <summary>${results.length === 0 ? `Checks (${checks.length})` : came}</summary>
    <p class="hint" role="status">${problem.value || (done < total && `Computing: ${done} of ${total} checked`)}</p>
    <ul class="checks">
      ${results.length === 0 && checks.map(({ title }) => html`<li>${title}</li>`)}
      ${results.map((each) => html`<li data-check=${each.check}>
        ${each.title}<span class="hint">${checked(each)}${h(Mark, { within: each.passed })}</span>
      </li>`)}
    </ul>
  </details>`;
}

/**
 * A run that uses the idea, in place of the figure.
 *
 * @param {{use: ScenarioPublic, course: Course}} props
 */
function Use({ use, course }) {
  const stage = useMemo(() => new LessonRun(use), []);
  useEffect(() => {
    course.used.value = stage;
    return () => (course.used.value = null);
  }, []);
  return html`<section class="lesson-stage" data-part="use" aria-label="Where it is used">
    <div class="use-line">
      <p ...${written(use.words)}></p>
      <a class="button" href=${linkTo({ recipe: use.recipe, position: use.frame })} target="_blank">Open as a session</a>
      <a class="button primary" href=${here("")}>Back to the lesson</a>
    </div>
    ${h(Stage, { stage, isLocked: false })}
  </section>`;
}

/** Progress in the course, and the lessons before and after.
 *
 * @param {{course: Course, lead: () => void}} props `lead` takes a class along.
 */
function Head({ course: { all, progress, lesson: { previous, next } }, lead }) {
  const title = (/** @type {string} */ way, /** @type {string} */ of) => `${way} lesson (${way[0]}): ${of}`;
  return html`
    ${all.length > 0 && html`<span class="lesson-progress" data-part="progress">${progress.done(all)} of ${all.length} done</span>`}
    <nav class="neighbours" aria-label="Lessons before and after">
      ${h(Neighbours, { kind: "learn", previous, next, title, go: lead })}
    </nav>
  `;
}

/** The class that follows the lesson: its figure, or the run in place of it.
 *
 * @param {Course} course
 */
function classOf(course) {
  const { title, id } = course.lesson;
  const control = new ClassControl(() => {
    const { run } = course;
    if (run === null) return { title, sessions: [], lesson: id, arrangement: {} };
    const { plots, layers } = run.scenario;
    return run.id.value === null ? null : { title, sessions: [run.id.value], lesson: id, arrangement: { plots, layers } };
  });
  effect(() => {
    const led = control.isHere.value ? control.follow.value : null;
    const figureOf = course.run === null && led !== null ? led.id : null;
    untracked(() => {
      course.askClass.value = led !== null && led.poll === null ? () => control.ask({ lesson: id }) : null;
      // The class sees the lecturer's figure.
      if (led?.poll?.revealed && led.poll.lesson === id) course.answer.value ??= "class";
      if (course.stage instanceof Demonstration) course.stage.followedBy(figureOf);
    });
  });
  control.find();
  return control;
}

/**
 * Fill the page with a lesson.
 *
 * @param {Course} course
 */
function opened(course) {
  const { lesson, stage } = course;
  const control = isFollower ? null : classOf(course);
  document.title = `${lesson.title} · pftrack`;
  part("title").textContent = lesson.number ? `${lesson.number} · ${lesson.title}` : lesson.title;
  classControl.value = control;
  render(h(Head, { course, lead: () => control?.takeAlong() }), part("beside"));
  render(h(() => course.progress.remark && html`<p class="note lesson-remark" role="status">${course.progress.remark}</p>`, {}), part("remark"));
  effect(() => {
    part("disconnected").hidden = !stage.isLost.value;
  });
  actions.d = () => stage.draw?.();
  return h(Lesson, { course });
}

async function load() {
  const others = isParticipant ? { lessons: [] } : request("GET lessons");
  const [lesson, { lessons: all }] = await Promise.all([request("GET lessons/{lesson}", { lesson: lastOfAddress() }), others]);
  // The link of a class opens only this lesson: the page has no links to other pages.
  const mine = isParticipant ? { ...lesson, previous: null, next: null, uses: [], checks: [] } : lesson;
  return opened(new Course(mine, all));
}

const help = () => openKeys(KEYS, html`<p class="hint">${ARROWS}</p>`);

function Tools() {
  return html`
    ${classControl.value && h(FollowChip, { control: classControl.value })}
    ${isFollower && html`<button type="button" title=${END_FORK} data-role="end" onClick=${endFork}>End</button>`}
    ${h(PrintButton, {})}${h(PresentationButton, {})}
    <button type="button" class="quiet icon-only" title="Keys (?)" aria-label="Keys" onClick=${help}>?</button>
  `;
}

/** @param {"next"|"prev"} rel The neighbour whose link to follow. */
function go(rel) {
  /** @type {HTMLElement|null} */ (document.querySelector(`.neighbours a[rel=${rel}]`))?.click();
}

/** @type {Record<string, () => void>} Actions of keys, where no run uses them. */
const actions = { n: () => go("next"), p: () => go("prev"), "?": help };
document.addEventListener("keydown", (event) => {
  if (!isPlain(event) || isTyping(event.target) || document.querySelector(".session-view") !== null) return;
  actions[event.key.toLowerCase()]?.();
});
addEventListener("hashchange", () => (hash.value = location.hash));
// The shown run ended when the page was left.
addEventListener("pageshow", (event) => event.persisted && location.reload());

const action = isParticipant ? { label: "Back to the class", href: START } : { label: "All lessons", href: "learn" };
const bones = html`<article class="lesson-text" data-part="text"><div class="shimmer bone"></div></article>`;
const unknown = { title: "Unknown lesson", action };
showPage("lesson", "learn", () => h(Loaded, { load, failed: "Couldn't load this lesson", bones, unknown }), h(Tools, {}));
