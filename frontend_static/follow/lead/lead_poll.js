/** The poll of a class on the lecturer's page, where the class in the room sees it as well. */

import { h } from "../../shared/dom.js";
import { PollView } from "../poll.js";

/** @import { Lead } from "./lead.js" */

/**
 * A poll with what the lecturer can do with it.
 *
 * @param {Lead} lead
 * @param {AbortSignal} signal
 * @returns {HTMLElement} Hidden while nothing is asked.
 */
export function ownPoll(lead, signal) {
  const reveal = h("button", { type: "button", class: "primary", data: { role: "reveal" }, on: { click: () => lead.reveal() } }, "Reveal");
  const withdraw = h("button", { type: "button", data: { role: "withdraw" }, on: { click: () => lead.withdraw() } });
  const view = new PollView({ vote: null, tools: [reveal, withdraw] });
  const draw = () => {
    const poll = lead.follow?.poll ?? null;
    view.element.hidden = poll === null;
    if (poll === null) return;
    reveal.hidden = poll.revealed;
    withdraw.textContent = poll.revealed ? "Close" : "Withdraw";
    view.show(poll, { followers: lead.follow?.followers });
  };
  lead.on(["follow"], draw, signal);
  draw();
  return view.element;
}

/**
 * Keep the poll on the page.
 *
 * @param {Lead} lead
 * @param {AbortSignal} signal
 */
export function leadPoll(lead, signal) {
  const place = h("aside", { class: "lead-poll", "aria-label": "The class is asked" }, ownPoll(lead, signal));
  document.body.append(place);
  signal.addEventListener("abort", () => place.remove());
}
