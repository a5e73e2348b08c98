/** The class's view: sessions, a comparison, or a lesson's figure; made again when the lecturer shows other content. */

import { Comparison, watch } from "../compare/compare.js";
import { Numbers } from "../learn/numbers.js";
import { Mounted } from "../session/mount.js";
import { SessionStart } from "../session/session_start.js";
import { sessionTitle } from "../session/steering.js";
import { request } from "../shared/api.js";
import { build, elementOf } from "../shared/dom.js";
import { FigureView } from "../shared/figure/figure.js";
import { Made } from "../shared/page.js";
import { follow as whenChanged } from "../shared/timing.js";
import { computed, h, html, useComputed, useEffect, useLayoutEffect, useSignal } from "../vendor/preact.js";
import { InForce, ofLesson, ofSession } from "./in_force.js";

/** @import { Told } from "../compare/compare.js" */
/** @import { Figure } from "../shared/figure/types.js" */
/** @import { FigurePublic, FigureShown, FollowedPublic, FollowPublic, LessonDetail } from "../shared/messages.js" */
/** @import { ReadonlySignal, Signal, VNode } from "../vendor/preact.js" */

/** @typedef {{plots?: string[], layers?: string[]}} Arrangement Plots to show, and layers to show in addition to the default ones. */
/** @typedef {{content: VNode, views: readonly Mounted[], end: () => void}} Watched */

/**
 * @typedef {object} Props
 * @property {ReadonlySignal<FollowPublic|null>} follow
 * @property {ReadonlySignal<FigureShown|null>} figure The figure of the shown lesson.
 * @property {Signal<readonly Mounted[]>} views The shown sessions, for the rest of the page.
 */

/** @param {Props} props */
export function ClassView({ follow, figure, views }) {
  if (follow.value === null) return null;
  const { sessions, lesson, arrangement } = follow.value;
  // A comparison stays when more is known about its runs, or when their arrangement changes.
  const key = JSON.stringify([sessions.map(({ id }) => id), lesson, comparisonIn(follow.value)?.outline ?? arrangement]);
  if (sessions.length > 0) return h(Sessions, { key, follow, views });
  if (lesson !== null) return h(Lesson, { key, lesson, figure });
  return html`<p class="empty">The lecturer shows nothing at the moment. This page updates automatically.</p>`;
}

/** @param {Pick<Props, "follow"|"views">} props */
function Sessions({ follow, views }) {
  const content = useSignal(/** @type {VNode|null} */ (null));
  // Not during rendering: `begin` renders components itself.
  useLayoutEffect(() => {
    const watched = begin(follow);
    content.value = watched.content;
    views.value = watched.views;
    return () => {
      views.value = [];
      watched.end();
    };
  }, []);
  return content.value;
}

/**
 * @param {Props["follow"]} follow
 * @returns {Watched}
 */
function begin(follow) {
  const shown = /** @type {FollowPublic} */ (follow.peek());
  const { sessions } = shown;
  const comparison = comparisonIn(shown);
  if (comparison !== null) return compare(comparison, follow);
  const { plots = [], layers = [] } = /** @type {Arrangement} */ (shown.arrangement);
  const several = sessions.length === 1 ? [whole(sessions[0].id, plots, layers)] : sessions.map((session) => beside(session, layers));
  const elements = several.map((each) => each.element);
  const make = () => (elements.length === 1 ? elements[0] : build("div", { class: "follow-several", data: { count: elements.length } }, elements));
  const views = several.map(({ view }) => view);
  return { content: h(Made, { make }), views, end: () => views.forEach((view) => view.dispose()) };
}

/**
 * @param {Told} first
 * @param {Props["follow"]} follow
 * @returns {Watched}
 */
function compare(first, follow) {
  const compared = watch(first, (follow.peek()?.sessions ?? []).map(({ id }) => id));
  whenChanged(() => follow.value, () => {
    const now = follow.value && comparisonIn(follow.value);
    if (now?.outcome) compared.know(now.outcome);
    if (now) compared.arrange(now.arrangement);
  }, compared.signal);
  return { content: h(Comparison, { compared }), views: compared.views, end: () => compared.end() };
}

/**
 * @param {string} session
 * @param {string[]} plots
 * @param {string[]} layers
 */
function whole(session, plots, layers) {
  const root = build("div", { class: "follow-one" });
  const start = new SessionStart(root, { session, layers, parts: ["scene", "branches", "plots", "readout"], view: "flat" });
  const view = new Mounted(start, { plots, readOnly: true });
  const entries = computed(() => (view.store.session === null ? [] : ofSession(view.store.session)));
  start.places.readout?.after(elementOf(h(InForce, { entries })));
  return { element: root, view };
}

/**
 * @param {FollowedPublic} session
 * @param {string[]} layers
 */
function beside({ id, title }, layers) {
  const place = build("div", { class: "follow-view" });
  const start = new SessionStart(place, { session: id, layers, parts: ["scene", "readout"], view: "flat" });
  const view = new Mounted(start, { readOnly: true });
  const name = computed(() => (view.store.session === null ? title : sessionTitle(view.store.session)));
  return { element: build("figure", {}, elementOf(html`<figcaption>${name}</figcaption>`), place), view };
}

/** The lecturer's figure of a lesson, with its numbers and the lecturer's changes.
 *
 * @param {{lesson: string, figure: Props["figure"]}} props
 */
function Lesson({ lesson, figure }) {
  const known = useSignal(/** @type {LessonDetail|null} */ (null));
  const shown = useComputed(() => {
    const of = figure.value?.lesson === lesson ? figure.value.figure : null;
    return /** @type {FigurePublic|null} */ (/** @type {unknown} */ (of));
  });
  const entries = useComputed(() => (known.value && shown.value ? ofLesson(known.value, shown.value.parameters, shown.value.seed) : []));
  // Even without the lesson's data the figure is shown; it is the main content.
  useEffect(() => void request("GET lessons/{lesson}", { lesson }).then((found) => (known.value = found), () => {}), []);
  const make = (/** @type {AbortSignal} */ end) => {
    const spot = build("div", { class: "lesson-figure-place" });
    // Only the lecturer changes the figure.
    const view = new FigureView(spot, { declared: (name) => known.peek()?.declarations.find((each) => each.name === name) }, end);
    whenChanged(() => shown.value, () => {
      if (shown.value) view.show(/** @type {Figure} */ (/** @type {unknown} */ (shown.value.figure)), { locked: true });
    }, end);
    return spot;
  };
  return html`<div class="follow-lesson">
    <h2 class="visually-hidden">Figure</h2>
    <div class="lesson-show">${h(Made, { make })}</div>
    <div class="lesson-numbers">${h(Numbers, { numbers: shown.value?.numbers ?? [] })}</div>
    ${h(InForce, { entries })}
  </div>`;
}

/** The comparison that a class follows, if it follows one; a program may have replaced the sessions meanwhile.
 *
 * @param {FollowPublic} follow
 * @returns {Told|null}
 */
function comparisonIn({ sessions, arrangement }) {
  const { comparison } = /** @type {{comparison?: Told}} */ (arrangement);
  return comparison?.outline?.runs?.length === sessions.length ? comparison : null;
}
