/**
 * The chip in a page's header: "Follow me", or how many follow. It opens what belongs to the class; a poll of the class stands
 * on the page.
 */

import { h, setText } from "../shared/dom.js";
import { icon } from "../shared/icons.js";
import { leadPoll } from "./lead_poll.js";
import { openSheet } from "./sheet.js";
import { following } from "./words.js";

/**
 * @param {import("./lead.js").Lead} lead
 * @param {AbortSignal} signal
 * @returns {HTMLButtonElement}
 */
export function followChip(lead, signal) {
  const words = h("span", {});
  const open = () => openSheet(lead, signal);
  const chip = h("button", { type: "button", class: "follow-chip", "aria-haspopup": "dialog", on: { click: open } }, icon("class"), words);
  const draw = () => {
    const { follow, isHere } = lead;
    words.classList.toggle("wide-only", follow === null);
    chip.toggleAttribute("data-leads", follow !== null);
    chip.toggleAttribute("data-elsewhere", follow !== null && !isHere);
    setText(words, follow === null ? "Follow me" : following(follow.followers));
    chip.title = titleOf(lead);
    chip.disabled = follow === null && !lead.mayBegin;
  };
  lead.on(["follow"], draw, signal);
  draw();
  leadPoll(lead, signal);
  return chip;
}

/** @param {import("./lead.js").Lead} lead */
function titleOf({ follow, isHere }) {
  if (follow === null) return "Show this page to a class: whoever opens a short link sees what you see";
  return isHere ? "The class sees this page" : `The class sees something else: ${follow.title}`;
}
