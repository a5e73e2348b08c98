/** "Try it yourself": a session of one's own, which begins where the lecturer's stands, or the lesson for oneself. */

import { openDialog } from "../shared/dialog.js";
import { fill, h, setText } from "../shared/dom.js";
import { attempt } from "../shared/toast.js";
import { followed as api } from "../lecturer/api.js";
import { sessionTitle } from "../session/timeline.js";

/** @import { Mounted } from "../session/mount.js" */
/** @import { FollowPublic } from "../shared/messages.js" */
/** @import { ClassStream } from "./class_stream.js" */

const TRY = "Try it yourself";

/**
 * @param {HTMLElement} place
 * @param {ClassStream} followed
 * @param {() => readonly Mounted[]} views Of the sessions that are shown.
 */
export function forkButton(place, followed, views) {
  const go = h("button", { type: "button", class: "primary", on: { click: begin } }, TRY);
  fill(place, go);
  const draw = () => {
    const { follow, state } = followed;
    place.hidden = follow === null || isEmpty(follow);
    go.disabled = state !== "open";
    setText(go, isOpen(followed) ? "Continue with your own copy" : TRY);
  };
  followed.on(["follow", "state"], draw);
  draw();

  function begin() {
    const { follow, mine } = followed;
    if (mine.fork !== null && isOpen(followed)) location.assign(mine.fork.page);
    else if (follow !== null && follow.sessions.length > 1) choose();
    else if (follow !== null) fork(follow.sessions.at(0)?.id ?? null);
  }

  /** @param {string|null} session Null for the lesson. */
  async function fork(session) {
    go.disabled = true;
    const made = await attempt(async () => {
      // A lesson that the class has left keeps the place, though nobody can open it.
      if (followed.mine.fork !== null) await api.giveBack();
      return api.fork({ session });
    });
    if (made === undefined) draw();
    else location.assign(made.page);
  }

  function choose() {
    const sessions = views().map(({ store }) => store.session).filter((session) => session !== null);
    openDialog("Which session?", (close) => [
      h("ul", { class: "fork-choices" }, sessions.map((session) => h("li", {}, choice(close, session.id, sessionTitle(session))))),
    ]);
  }

  /**
   * @param {() => void} close
   * @param {string} session
   * @param {string} title
   */
  function choice(close, session, title) {
    const take = () => {
      close();
      fork(session);
    };
    return h("button", { type: "button", on: { click: take } }, title);
  }
}

/** @param {FollowPublic} follow */
function isEmpty({ sessions, lesson }) {
  return sessions.length === 0 && lesson === null;
}

/**
 * Whether there is something of one's own that can be opened; a lesson of one's own ends when the class goes on to another.
 *
 * @param {ClassStream} followed
 */
function isOpen({ follow, mine: { fork } }) {
  return fork !== null && (fork.id !== null || fork.page === `learn/${follow?.lesson}`);
}
