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
  const followers = amount(0, 1);
  const forks = amount(0, 0);
  /** @type {HTMLInputElement} */
  const open = h("input", { type: "checkbox", on: { change: () => control.change({ is_open: open.checked }) } });
  const until = h("p", { class: "hint" });
  followers.addEventListener("change", () => change("most_followers", followers));
  forks.addEventListener("change", () => change("most_forks", forks));
  const draw = () => {
    const { follow } = control;
    if (follow === null) return;
    setText(now, `${following(follow.followers)}, ${tried(follow.forks)}.`);
    show(followers, follow.most_followers);
    show(forks, follow.most_forks);
    open.checked = follow.is_open;
    setText(until, `It ends automatically ${moment(follow.expires)}.`);
  };
  control.on(["follow"], draw, signal);
  draw();
  return h(
    "section",
    { class: "class-limits", "aria-label": "Who follows" },
    now,
    limit("Most followers", followers),
    limit("Most own copies at one time", forks),
    h("label", { class: "class-limit check" }, h("span", {}, "New followers may join"), open),
    until,
  );

  /**
   * @param {"most_followers"|"most_forks"} name
   * @param {HTMLInputElement} field
   */
  async function change(name, field) {
    const { follow } = control;
    if (follow === null) return;
    const isDone = Number.isFinite(field.valueAsNumber) && (await control.change({ [name]: field.valueAsNumber }));
    if (!isDone) field.value = String(follow[name]);
  }
}

/**
 * What is being typed is left alone.
 *
 * @param {HTMLInputElement} field
 * @param {number} value
 */
function show(field, value) {
  if (document.activeElement !== field) field.value = String(value);
}

/** @param {number} forks */
function tried(forks) {
  if (forks === 0) return "no own copies";
  return forks === 1 ? "1 own copy" : `${forks} own copies`;
}
