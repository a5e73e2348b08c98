/** The gallery of failures: by kind, each with its number, and the errors of both runs once they are computed. */

import { request } from "../shared/api.js";
import { plainAxis } from "../shared/figure/axes.js";
import { StillFigure } from "../shared/figure/figure.js";
import { lineOver } from "../shared/figure/kinds.js";
import { quantity } from "../shared/format.js";
import { Loaded, showPage } from "../shared/page.js";
import { PresentationButton } from "../shared/presentation.js";
import { h, html, signal, useEffect, useMemo } from "../vendor/preact.js";
import { differenceText, measure } from "./words.js";

/** @import { FailurePublic, FailureResult, FailureSide } from "../shared/messages.js" */
/** @import { Course } from "./words.js" */

const EMPTY = "None of the installed experiments declares a failure.";
const BONE = html`<div class="failure-card" aria-hidden="true">
  <div class="bone short shimmer"></div><div class="curve-place shimmer"></div><div class="bone shimmer"></div>
</div>`;
/** Requests end only with the page. */
const { signal: end } = new AbortController();

/** @param {{failures: FailurePublic[]}} props */
function Gallery({ failures }) {
  const courses = useMemo(() => new Map(failures.map((failure) => [failure, signal(/** @type {Course["value"]} */ (null))])), [failures]);
  useEffect(() => void computeAll(courses), [courses]);
  const kinds = [...new Set(failures.map(({ kind_title: kind }) => kind))];
  return kinds.map((kind) => {
    const cards = [...courses].filter(([failure]) => failure.kind_title === kind).map(([failure, course]) => h(Card, { failure, course }));
    return html`<section aria-label=${kind}><h2>${kind}</h2><div class="failure-cards">${cards}</div></section>`;
  });
}

/** @param {{failure: FailurePublic, course: Course}} props */
function Card({ failure, course }) {
  return html`<article class="failure-card" data-failure=${failure.id}>
    <h3><a href=${failure.page}><span class="failure-number">${failure.number}</span>${failure.title}</a></h3>
    <div class="curve-place">${drawn(course.value, failure.frame)}</div>
    <p>${failure.diagnosis}</p>
    <p class="hint">${failure.experiment_title} · ${differenceText(failure)}</p>
  </article>`;
}

/**
 * @param {Course["value"]} course
 * @param {number} frame
 */
function drawn(course, frame) {
  if (course === null) return html`<div class="shimmer"></div>`;
  if (typeof course === "string") return html`<p class="hint" role="status">${course}</p>`;
  return h(Curve, { course, frame });
}

/**
 * The errors of the failing run and of the cured one over their frames, in a small figure.
 *
 * @param {{course: FailureResult, frame: number}} props `frame` is the frame before the failure; it is marked.
 */
function Curve({ course: { unit, failing, cured }, frame }) {
  const last = Math.max(failing.errors.length - 1, 1);
  const largest = Math.max(largestOf(failing), largestOf(cured)) || 1;
  const traces = [
    lineOver({ x: [frame, frame], y: [0, largest], ink: "muted", width: 1, dashed: true }),
    lineOver({ y: errorsOf(cured), ink: "second", width: 2, dashed: true }),
    lineOver({ y: errorsOf(failing), ink: "lost", width: 2.5 }),
  ];
  const [most, mostCured] = [failing, cured].map((run) => `up to ${quantity(largestOf(run), unit)} ${unit}`);
  const [final, finalCured] = [failing, cured].map(({ errors }) => `in the end ${quantity(errors.at(-1) ?? null, unit)} ${unit}`);
  const words = `Error over ${last + 1} frames. It fails after frame ${frame}: ${most}, ${final}. Cured: ${mostCured}, ${finalCured}.`;
  const panel = { x: plainAxis({ low: 0, high: last, hidden: true }), y: plainAxis({ low: 0, high: largest, hidden: true }), traces };
  return html`<figure class="curve">
    ${h(StillFigure, { kind: "figure-miniature", words, panels: [panel] })}
    <figcaption><span class="key failing">fails, ${most}</span><span class="key cured">cured, ${mostCured}</span></figcaption>
  </figure>`;
}

/** @param {FailureSide} run */
function errorsOf({ errors }) {
  return errors.map((error) => error ?? NaN);
}

/** @param {FailureSide} run */
function largestOf({ errors }) {
  return errors.reduce((/** @type {number} */ most, error) => Math.max(most, error ?? 0), 0);
}

/** One after the other: each is computed once, and other people may be tracking meanwhile.
 *
 * @param {Map<FailurePublic, Course>} courses
 */
async function computeAll(courses) {
  for (const [failure, course] of courses) await measure(failure, course, end);
}

async function load() {
  const failures = await request("GET failures");
  return failures.length > 0 ? h(Gallery, { failures }) : html`<p class="empty">${EMPTY}</p>`;
}

addEventListener("pageshow", (event) => event.persisted && location.reload());
const bones = html`<div class="failure-cards">${[BONE, BONE, BONE]}</div>`;
showPage("failures", "failures", () => h(Loaded, { load, failed: "Couldn't load the failures", bones }), h(PresentationButton, {}));
