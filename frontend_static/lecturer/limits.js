/** Who follows, who tries it themselves, and how many may. */

import { h, setText } from "../shared/dom.js";
import { moment } from "../shared/format.js";
import { amount, limit } from "./begin_form.js";
import { following } from "./text.js";

/** @import { ClassControl } from "./class_control.js" */

/**
 * @param {ClassControl} control
 * @param {AbortSignal} signal
 */
export function limits(control, signal) {
  const now = h("p", { role: "status", data: { role: "class-count" } });
  const followers = amount(0);
  const until = h("p", { class: "hint" });
  followers.addEventListener("change", change);
  const draw = () => {
    const { follow } = control;
    if (follow === null) return;
    setText(now, `${following(follow.followers)}, ${tried(follow.forks)}.`);
    // What is being typed is left alone.
    if (document.activeElement !== followers) followers.value = String(follow.most_followers);
    setText(until, `It ends automatically ${moment(follow.expires)}.`);
  };
  control.on(["follow"], draw, signal);
  draw();
  return h("section", { class: "class-limits", "aria-label": "Who follows" }, now, limit(followers), until);

  async function change() {
    const { follow } = control;
    if (follow === null) return;
    const most = followers.valueAsNumber;
    const isDone = Number.isFinite(most) && (await control.change({ most_followers: most }));
    if (!isDone) followers.value = String(follow.most_followers);
  }
}

/** @param {number} forks */
function tried(forks) {
  if (forks === 0) return "no own copies";
  return forks === 1 ? "1 own copy" : `${forks} own copies`;
}
