/**
 * All that belongs to a class: before it begins its limits, and then the link with its QR code, who follows, a poll, the
 * limits, and the end.
 */

import { confirmLoss, openDialog } from "../shared/dialog.js";
import { fill, h } from "../shared/dom.js";
import { beginning } from "./beginning.js";
import { limits } from "./limits.js";
import { linkPart } from "./link.js";
import { ownPoll } from "./lead_poll.js";
import { pollForm } from "./poll_form.js";
import { following } from "./words.js";

/** @import { Lead } from "./lead.js" */

/**
 * @param {Lead} lead
 * @param {AbortSignal} signal
 */
export function openSheet(lead, signal) {
  const end = new AbortController();
  const until = AbortSignal.any([signal, end.signal]);
  openDialog("A class that follows", (close) => {
    const place = h("div", { class: "class-sheet" });
    let shown = "";
    const draw = () => {
      const now = `${lead.follow?.id} ${lead.isHere}`;
      if (now === shown) return;
      shown = now;
      if (lead.follow !== null) fill(place, running(lead, close, until));
      else if (lead.mayBegin) fill(place, beginning(lead, until));
      else close();
    };
    lead.on(["follow"], draw, until);
    draw();
    return [place];
  }, { wide: true }).addEventListener("close", () => end.abort());
}

/**
 * @param {Lead} lead
 * @param {() => void} close
 * @param {AbortSignal} signal
 */
function running(lead, close, signal) {
  const follow = /** @type {NonNullable<Lead["follow"]>} */ (lead.follow);
  return [
    !lead.isHere && elsewhere(lead),
    linkPart(follow),
    asking(lead, close, signal),
    limits(lead, signal),
    h("footer", {}, h("button", { type: "button", class: "danger", data: { role: "end-class" }, on: { click: () => finish(lead) } }, "End")),
  ];
}

/**
 * The class sees something else than this page.
 *
 * @param {Lead} lead
 */
function elsewhere(lead) {
  const follow = /** @type {NonNullable<Lead["follow"]>} */ (lead.follow);
  const show = h("button", { type: "button", class: "primary", disabled: !lead.isReady, on: { click: () => lead.show(follow) } }, "Show this page");
  return h("p", { class: "note class-elsewhere" }, h("span", {}, `The class sees ${follow.title}. `), show);
}

/**
 * A poll, or the form for one.
 *
 * @param {Lead} lead
 * @param {() => void} close
 * @param {AbortSignal} signal
 */
function asking(lead, close, signal) {
  const form = pollForm(async (poll) => {
    // What is asked stands on the page, where the run goes on.
    if (await lead.ask(poll)) close();
  });
  const draw = () => (form.hidden = lead.follow === null || lead.follow.poll !== null);
  lead.on(["follow"], draw, signal);
  draw();
  return h("section", { class: "class-poll", "aria-label": "Ask the class" }, form, ownPoll(lead, signal));
}

/** @param {Lead} lead */
async function finish(lead) {
  const { follow } = lead;
  if (follow === null) return;
  const text = `${following(follow.followers)}. Nobody can open the link again, and what followers tried themselves ends, too.`;
  if (follow.followers === 0 || (await confirmLoss({ title: "End the class?", text, action: "End for all" }))) await lead.end();
}
