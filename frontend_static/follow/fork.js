/** "Try it yourself": a session of one's own, which begins where the lecturer's stands. */

import { openDialog } from "../shared/dialog.js";
import { fill, h, setText } from "../shared/dom.js";
import { attempt } from "../shared/toast.js";
import { followed as api } from "./api.js";

/** @import { FollowedPublic } from "../shared/messages.js" */
/** @import { Followed } from "./followed.js" */

const TRY = "Try it yourself";

/**
 * @param {HTMLElement} place
 * @param {Followed} followed
 */
export function forkButton(place, followed) {
  const words = h("span", { class: "hint", id: "places", role: "status" });
  const go = h("button", { type: "button", class: "primary", "aria-describedby": "places", on: { click: begin } }, TRY);
  fill(place, words, go);
  const draw = () => {
    const { follow, mine, state } = followed;
    place.hidden = follow === null || follow.sessions.length === 0 || (follow.most_forks === 0 && mine.fork === null);
    if (follow === null) return;
    const isFull = follow.forks >= follow.most_forks && mine.fork === null;
    go.disabled = isFull || state !== "open";
    setText(go, mine.fork === null ? TRY : "Go on with your own");
    setText(words, isFull ? `${placesTaken(follow.most_forks)}; one may become free` : "");
  };
  followed.on(["follow", "state"], draw);
  draw();

  function begin() {
    const { follow, mine } = followed;
    if (mine.fork !== null) location.assign(mine.fork.page);
    else if (follow?.sessions.length === 1) fork(follow.sessions[0].id);
    else if (follow !== null) choose(follow.sessions);
  }

  /** @param {string} session */
  async function fork(session) {
    go.disabled = true;
    const made = await attempt(() => api.fork({ session }));
    if (made === undefined) draw();
    else location.assign(made.page);
  }

  /** @param {readonly FollowedPublic[]} sessions */
  function choose(sessions) {
    openDialog("Which of them?", (close) => [
      h("ul", { class: "fork-choices" }, sessions.map(({ id, title }, number) => h("li", {}, choice(close, id, `${number + 1} · ${title}`)))),
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

/** @param {number} places */
function placesTaken(places) {
  return places === 1 ? "The one place is taken" : `All ${places} places are taken`;
}
