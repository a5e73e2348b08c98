/** What the class sees, made anew when the lecturer shows something else. */

import { watch } from "../compare/compare.js";
import { fill, h } from "../shared/dom.js";
import { LessonView } from "./lesson_view.js";
import { showSessions } from "./sessions_view.js";

/** @import { RunComparison, Told } from "../compare/compare.js" */
/** @import { Mounted } from "../session/mount.js" */
/** @import { FigurePublic, FollowPublic } from "../shared/messages.js" */
/** @import { ClassStream } from "./class_stream.js" */

export class ClassView {
  #place;
  #followed;
  #made = "";
  #told = "";
  #end = new AbortController();
  /** @type {LessonView|null} */
  #lesson = null;
  /** @type {RunComparison|null} */
  #compared = null;

  /**
   * The sessions that are shown.
   *
   * @type {Mounted[]}
   */
  views = [];

  /**
   * @param {HTMLElement} place
   * @param {ClassStream} followed
   * @param {() => void} changed Called when other sessions are shown.
   */
  constructor(place, followed, changed) {
    this.#place = place;
    this.#followed = followed;
    followed.on(["follow"], () => this.#look(changed));
    followed.on(["figure"], () => this.#draw());
  }

  /** Take all of it from the page. */
  clear() {
    this.#end.abort();
    if (this.#compared === null) for (const view of this.views) view.dispose();
    this.#compared?.end();
    this.#compared = null;
    this.views = [];
    this.#lesson = null;
    this.#made = "";
    fill(this.#place);
  }

  /** @param {() => void} changed */
  #look(changed) {
    const { follow } = this.#followed;
    if (follow === null) return;
    const { sessions, lesson, arrangement } = follow;
    const comparison = comparisonIn(follow);
    const ids = sessions.map(({ id }) => id);
    const made = JSON.stringify([ids, lesson, comparison?.outline ?? arrangement]);
    if (made === this.#made) {
      this.#follow(comparison);
      return;
    }
    this.clear();
    this.#made = made;
    this.#end = new AbortController();
    if (comparison !== null) this.views = (this.#compared = watch(this.#place, comparison, ids)).views;
    else if (sessions.length > 0) this.views = showSessions(this.#place, sessions, arrangement);
    else if (lesson !== null) this.#lesson = new LessonView(this.#place, lesson, this.#end.signal);
    else fill(this.#place, h("p", { class: "empty" }, "The lecturer shows nothing at the moment. This page updates automatically."));
    this.#draw();
    changed();
  }

  /**
   * A comparison stays when more is known of its runs, or when they are arranged otherwise.
   *
   * @param {Told|null} comparison
   */
  #follow(comparison) {
    const told = JSON.stringify(comparison);
    if (comparison === null || told === this.#told) return;
    this.#told = told;
    if (comparison.outcome !== null) this.#compared?.know(comparison.outcome);
    this.#compared?.arrange(comparison.arrangement);
  }

  #draw() {
    const { figure } = this.#followed;
    if (figure === null || figure.lesson !== this.#followed.follow?.lesson) return;
    this.#lesson?.show(/** @type {FigurePublic} */ (/** @type {unknown} */ (figure.figure)));
  }
}

/**
 * The comparison that a class follows, if it is one: a program may have exchanged the sessions meanwhile.
 *
 * @param {FollowPublic} follow
 * @returns {Told|null}
 */
function comparisonIn({ sessions, arrangement }) {
  const { comparison } = /** @type {{comparison?: Told}} */ (arrangement);
  return comparison?.outline?.runs?.length === sessions.length ? comparison : null;
}
