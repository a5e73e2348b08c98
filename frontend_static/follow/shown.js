/** What the class sees, made anew when the lecturer shows something else. */

import { fill, h } from "../shared/dom.js";
import { LessonView } from "./lesson_view.js";
import { showSessions } from "./sessions_view.js";

/** @import { Mounted } from "../session/mount.js" */
/** @import { FigurePublic } from "../shared/messages.js" */
/** @import { Followed } from "./followed.js" */

export class Shown {
  #place;
  #followed;
  #made = "";
  #end = new AbortController();
  /** @type {LessonView|null} */
  #lesson = null;

  /**
   * The sessions that are shown.
   *
   * @type {Mounted[]}
   */
  views = [];

  /**
   * @param {HTMLElement} place
   * @param {Followed} followed
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
    for (const view of this.views) view.dispose();
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
    const made = JSON.stringify([sessions.map(({ id }) => id), lesson, arrangement]);
    if (made === this.#made) return;
    this.clear();
    this.#made = made;
    this.#end = new AbortController();
    if (sessions.length > 0) this.views = showSessions(this.#place, sessions, arrangement);
    else if (lesson !== null) this.#lesson = new LessonView(this.#place, lesson, this.#end.signal);
    else fill(this.#place, h("p", { class: "empty" }, "The lecturer shows nothing at the moment. It begins here by itself."));
    this.#draw();
    changed();
  }

  #draw() {
    const { figure } = this.#followed;
    if (figure === null || figure.lesson !== this.#followed.follow?.lesson) return;
    this.#lesson?.show(/** @type {FigurePublic} */ (/** @type {unknown} */ (figure.figure)));
  }
}
