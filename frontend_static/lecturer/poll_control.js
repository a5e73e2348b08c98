/** The poll of a class on the lecturer's page, where the class in the room sees it as well. */

import { dialogIsOpen } from "../shared/dialog.js";
import { h } from "../shared/dom.js";
import { isPresenting } from "../shared/presentation.js";
import { PollView } from "./poll.js";

/** @import { ClassControl } from "./class_control.js" */

/**
 * A poll with what the lecturer can do with it.
 *
 * @param {ClassControl} control
 * @param {AbortSignal} signal
 * @param {HTMLButtonElement[]} [more] Further buttons, before those that reveal and withdraw.
 * @returns {HTMLElement} Hidden while nothing is asked.
 */
export function pollPart(control, signal, more = []) {
  const reveal = h("button", { type: "button", class: "primary", data: { role: "reveal" }, on: { click: () => control.reveal() } }, "Reveal");
  const withdraw = h("button", { type: "button", data: { role: "withdraw" }, on: { click: () => control.withdraw() } });
  const view = new PollView({ vote: null, tools: [...more, reveal, withdraw] });
  const draw = () => {
    const poll = control.follow?.poll ?? null;
    view.element.hidden = poll === null;
    if (poll === null) return;
    reveal.hidden = poll.revealed;
    withdraw.textContent = poll.revealed ? "Close" : "Withdraw";
    view.show(poll, { followers: control.follow?.followers });
  };
  control.on(["follow"], draw, signal);
  draw();
  return view.element;
}

/**
 * Keep the poll on the page, over its lower edge. Folded to the question and how many have answered, it is a line of the page. Of who
 * presents, a revealed one takes all of the page, until the next key puts it back to its place.
 *
 * @param {ClassControl} control
 * @param {AbortSignal} signal
 */
export function pollControl(control, signal) {
  /** @type {HTMLButtonElement} */
  const fold = h("button", { type: "button", class: "quiet", data: { role: "fold" }, on: { click: () => show(isFolded()) } });
  const place = h("aside", { class: "lead-poll", "aria-label": "The class is asked" }, pollPart(control, signal, [fold]));
  const isFolded = () => place.hasAttribute("data-folded");
  const show = (/** @type {boolean} */ isWhole) => {
    place.toggleAttribute("data-folded", !isWhole);
    fold.setAttribute("aria-expanded", String(isWhole));
    fold.textContent = isWhole ? "Fold" : "Unfold";
  };
  const stage = (/** @type {boolean} */ isWhole) => place.toggleAttribute("data-staged", isWhole);
  let poll = "";
  control.on(["follow"], () => {
    const { id = "", revealed = false } = control.follow?.poll ?? {};
    // What is asked, and what is revealed, is there to be seen.
    const before = poll;
    if (before === (poll = `${id} ${revealed}`)) return;
    show(true);
    // Whoever comes to another page has seen it.
    stage(revealed && before !== "");
  }, signal);
  document.addEventListener("keydown", (event) => {
    if (!place.hasAttribute("data-staged") || !isPresenting() || dialogIsOpen() || isForBrowser(event)) return;
    // It was for the result; the next one is for the page again.
    event.preventDefault();
    event.stopImmediatePropagation();
    stage(false);
    show(false);
  }, { capture: true, signal });
  show(true);
  (document.querySelector(".top") ?? document.body.firstElementChild)?.after(place);
  signal.addEventListener("abort", () => place.remove());
}

/**
 * Whether a key changes which element has the focus, presses the button that has it, or is a part of another key.
 *
 * @param {KeyboardEvent} event
 */
function isForBrowser({ key, target, ctrlKey, metaKey, altKey }) {
  if (ctrlKey || metaKey || altKey || ["Tab", "Shift"].includes(key)) return true;
  return (key === " " || key === "Enter") && target instanceof Element && target.closest(".lead-poll button") !== null;
}
