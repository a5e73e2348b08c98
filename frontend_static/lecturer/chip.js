/**
 * The chip in a page's header: "Follow me", or how many follow. It opens what belongs to the class; a poll of the class, and the
 * line of a lecture, stand on the page.
 */

import { h, setText } from "../shared/dom.js";
import { icon } from "../shared/icons.js";
import { pollControl } from "./poll_control.js";
import { openClassDialog } from "./class_dialog.js";
import { lectureBar } from "./lecture_bar.js";
import { following, seeElsewhere } from "./text.js";

/**
 * @param {import("./class_control.js").ClassControl} control
 * @param {AbortSignal} signal
 * @returns {HTMLButtonElement}
 */
export function followChip(control, signal) {
  const words = h("span", {});
  const open = () => openClassDialog(control, signal);
  const chip = h("button", { type: "button", class: "follow-chip", "aria-haspopup": "dialog", on: { click: open } }, icon("class"), words);
  const draw = () => {
    const { follow, isHere } = control;
    words.classList.toggle("wide-only", follow === null);
    chip.toggleAttribute("data-leads", follow !== null);
    chip.toggleAttribute("data-elsewhere", follow !== null && !isHere);
    setText(words, wordsOf(control));
    chip.title = titleOf(control);
    chip.disabled = follow === null && !control.mayBegin;
  };
  control.on(["follow"], draw, signal);
  draw();
  pollControl(control, signal);
  lectureBar(control, signal);
  return chip;
}

/** @param {import("./class_control.js").ClassControl} control */
function wordsOf({ follow, isHere }) {
  if (follow === null) return "Follow me";
  return isHere ? following(follow.followers) : seeElsewhere(follow.followers);
}

/** @param {import("./class_control.js").ClassControl} control */
function titleOf({ follow, isHere }) {
  if (follow === null) return "Show this page to a class, which opens a short link; or add it to a lecture";
  return isHere ? "The class sees this page" : `The class sees something else: ${follow.title}`;
}
