/** A failure and its cure: two runs of one seed in step, the reason of the failure, and the remedy. */

import { LinkNow } from "../compare/compare.js";
import { JointView } from "../compare/joint.js";
import { ClassControl, FollowChip } from "../lecturer/class_control.js";
import { messageOf, request } from "../shared/api.js";
import { linkTo as linkToComparison } from "../shared/comparison.js";
import { Icon, lastOfAddress, Neighbours, part } from "../shared/dom.js";
import { CodeButton } from "../shared/exports.js";
import { quantity } from "../shared/format.js";
import { Failed, Loaded, Made, showPage } from "../shared/page.js";
import { PresentationButton, PrintButton } from "../shared/presentation.js";
import { linkTo } from "../shared/share_link.js";
import { tokens } from "../shared/theme.js";
import { h, html, render, signal } from "../vendor/preact.js";
import { measure, settings, value } from "./words.js";

/** @import { FailurePublic, FailureResult } from "../shared/messages.js" */

/** @typedef {"failing"|"cured"} Side */

/** @type {readonly Side[]} */
const SIDES = ["failing", "cured"];
const HEADS = { failing: "Fails", cured: "Cured" };
/** The colours of the gallery's curves. */
const COLOURS = /** @type {const} */ ({ failing: "lost", cured: "second" });
const GALLERY = { label: "All failures", href: "failures" };

/** A failure with its two runs, from the frame before it happens. */
class Pair extends JointView {
  /** Why the two runs could not be started. */
  problem = signal("");
  /** The measurement of both whole runs, or a sentence in its place. */
  course = signal(/** @type {FailureResult|string|null} */ (null));

  /** @param {FailurePublic} failure */
  constructor(failure) {
    const { frame } = failure;
    const members = SIDES.map((side) => {
      const recipe = { recipe: failure[side], position: frame };
      return { name: HEADS[side], label: HEADS[side], colour: colourOf(side), first: 0, recipe };
    });
    super(members, { kind: "failure-view" });
    this.failure = failure;
    this.store.whole.value = { beforeLoss: frame, notes: [{ frame, note: "before it happens" }] };
    this.listen({});
    this.begun.then(() => control.find(), (error) => {
      this.problem.value = messageOf(error);
      this.end();
    });
    measure(failure, this.course, this.signal);
  }

  /** The class's view: a comparison whose settings are those that the cure changes. */
  get told() {
    const { differences } = this.failure;
    const runs = SIDES.map((side) => ({ name: HEADS[side], title: `${HEADS[side]}, ${settings(this.failure, side)}`, colour: colourOf(side), first: 0 }));
    const changed = differences.map((each) => ({ name: each.title, title: each.title, values: SIDES.map((side) => value(each[side], each.unit)) }));
    return { outline: { unit: "", settings: changed, runs }, outcome: null, arrangement: "side" };
  }
}

/** @param {Side} side */
function colourOf(side) {
  return tokens(COLOURS[side])[COLOURS[side]];
}

const shown = signal(/** @type {Pair|null} */ (null));
const control = new ClassControl(() => {
  const pair = shown.value;
  if (pair === null || pair.sessions.value.length === 0) return null;
  return { title: pair.failure.title, sessions: pair.sessions.value, lesson: null, arrangement: { comparison: pair.told } };
});

async function load() {
  const failure = await request("GET failures/{failure}", { failure: lastOfAddress() });
  part("title").textContent = `${failure.number}  ${failure.title}`;
  document.title = `${failure.title} · pftrack`;
  history.replaceState(null, "", failure.page + location.search);
  const begin = () => (shown.value = new Pair(failure));
  begin();
  return h(Runs, { begin });
}

/** @param {{begin: () => void}} props */
function Runs({ begin }) {
  const pair = shown.value;
  if (pair === null) return null;
  if (pair.problem.value) return h(Failed, { title: "Couldn't start the two runs", message: pair.problem.value, again: begin });
  const { frame } = pair.failure;
  const before = html`<button type="button" onClick=${() => pair.steering.seek(frame)}>Frame ${frame}, before it happens</button>`;
  return [...SIDES.map((side, place) => h(Column, { pair, side, place })), h(Made, { make: () => pair.deck("failure-deck", before) })];
}

/** @param {{pair: Pair, side: Side, place: number}} props One of the runs: its text and its picture. */
function Column({ pair: { failure, course, places }, side, place }) {
  return html`<section class="failure-column" aria-label=${HEADS[side]} data-side=${side}>
    <div class="failure-words">
      <h2>
        <span class="failure-verdict">${HEADS[side]}</span><span class="failure-setting">${settings(failure, side)}</span>
        <a class="link" href=${linkTo({ recipe: failure[side], position: failure.frame })}>Open as a session</a>
      </h2>
      <p>${side === "failing" ? failure.diagnosis : failure.cure}</p>
      ${h(Measured, { course: course.value, side })}
    </div>
    ${h(Made, { make: () => places[place] })}
  </section>`;
}

/** Why a run stays lost, the finding in its numbers, and the measures of the failure from the loss on.
 *
 * @param {{course: FailureResult|string|null, side: Side}} props
 */
function Measured({ course, side }) {
  if (course === null || typeof course === "string") {
    return html`<p class="measured" role="status">${course ?? html`<span class="bone shimmer"></span>`}</p>`;
  }
  const { frame, measured } = course;
  const { finding, why, lost } = course[side];
  const terms = measured.map((it) => html`<div><dt>${it.title}</dt><dd>${value(quantity(it[side], it.unit), it.unit)}</dd></div>`);
  return html`<p class="measured" role="status">${lost.at(-1) && html`<strong>${why}</strong> `}${finding}</p>
    ${terms.length > 0 && html`<div class="failure-numbers"><p class="hint">From frame ${frame} on</p><dl>${terms}</dl></div>`}`;
}

/** The failures before and after; the next one is the next page of the lecture. */
function Around() {
  const { previous, next } = shown.value?.failure ?? {};
  return h(Neighbours, { kind: "failures", previous, next, title: (way, title) => `${way} failure, ${title}`, go: () => control.takeAlong() });
}

/** Links to both runs as a comparison, at the shown frame, and as source code. */
function Ways() {
  const pair = shown.value;
  if (pair === null) return null;
  const runs = SIDES.map((side) => ({ recipe: pair.failure[side] }));
  const title = "Compare both runs: their differences, results and plots";
  const content = [h(Icon, { name: "compare" }), html`<span class="wide-only">Compare</span>`];
  const aim = () => linkToComparison({ runs, position: pair.position });
  return [
    h(LinkNow, { class: "button tool", aim, title, label: "Compare both runs", content }),
    h(CodeButton, { ask: () => request("POST source-code", { body: { runs } }) }),
  ];
}

// The sessions ended with the page; a page from the browser's cache starts again.
addEventListener("pageshow", (event) => event.persisted && location.reload());
render(h(Around, {}), part("neighbours"));
render(h(Ways, {}), part("compare"));
const bones = html`<div class="failure-wait"><div class="shimmer"></div></div>`;
const unknown = { title: "Unknown failure", action: GALLERY };
const content = () => h(Loaded, { load, failed: "Couldn't load this failure", bones, unknown });
showPage("failure", "failures", content, [h(FollowChip, { control }), h(PrintButton, {}), h(PresentationButton, {})]);
