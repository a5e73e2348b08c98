/**
 * All that belongs to a class: before it begins its limits, and then the link with its QR code, who follows, a poll, the
 * limits, and the end. What the page shows can be added to a lecture here as well.
 */

import { confirmLoss, openDialog } from "../shared/dialog.js";
import { fill, h } from "../shared/dom.js";
import { isParticipant } from "../shared/participant.js";
import { addToLecture } from "./add_to_lecture.js";
import { answeredList } from "./answered.js";
import { polls } from "./api.js";
import { beginForm } from "./begin_form.js";
import { limits } from "./limits.js";
import { linkPart } from "./link.js";
import { pollPart } from "./poll_control.js";
import { pollForm } from "./poll_form.js";
import { following } from "./text.js";

/** @import { ClassControl } from "./class_control.js" */
/** @import { PollCreateRequest } from "../shared/messages.js" */

const MOST_BEFORE = 20;

/**
 * @param {ClassControl} control
 * @param {AbortSignal} signal
 */
export function openClassDialog(control, signal) {
  const end = new AbortController();
  const until = AbortSignal.any([signal, end.signal]);
  openDialog("A class that follows", (close) => {
    const place = h("div", { class: "class-sheet" });
    let shown = "";
    const draw = () => {
      const now = `${control.follow?.id} ${control.isHere}`;
      if (now === shown) return;
      shown = now;
      if (control.follow !== null) fill(place, running(control, close, until));
      else if (control.mayBegin) fill(place, beginForm(control, until));
      else close();
    };
    control.on(["follow"], draw, until);
    draw();
    return [place, !isParticipant && control.isReady && addToLecture()];
  }, { wide: true }).addEventListener("close", () => end.abort());
}

/**
 * @param {ClassControl} control
 * @param {() => void} close
 * @param {AbortSignal} signal
 */
function running(control, close, signal) {
  const follow = /** @type {NonNullable<ClassControl["follow"]>} */ (control.follow);
  return [
    !control.isHere && elsewhere(control),
    linkPart(follow),
    asking(control, close, signal),
    limits(control, signal),
    h("footer", {}, h("button", { type: "button", class: "danger", data: { role: "end-class" }, on: { click: () => finish(control) } }, "End")),
  ];
}

/**
 * The class sees something else than this page.
 *
 * @param {ClassControl} control
 */
function elsewhere(control) {
  const follow = /** @type {NonNullable<ClassControl["follow"]>} */ (control.follow);
  const show = h("button", { type: "button", class: "primary", disabled: !control.isReady, on: { click: () => control.show(follow) } }, "Show this page");
  return h("p", { class: "note class-elsewhere" }, h("span", {}, `The class sees ${follow.title}. `), show);
}

/**
 * A poll, or the form for one, and what classes were asked before.
 *
 * @param {ClassControl} control
 * @param {() => void} close
 * @param {AbortSignal} signal
 */
function asking(control, close, signal) {
  const ask = async (/** @type {PollCreateRequest} */ poll) => {
    // What is asked stands on the page, where the run goes on.
    if (await control.ask(poll)) close();
  };
  const form = pollForm(ask);
  const { lesson } = control;
  const ownWords = "Ask the question of this lesson";
  const ofLesson = lesson !== null && h("button", { type: "button", data: { role: "ask-lesson" }, on: { click: () => ask({ lesson }) } }, ownWords);
  const before = h("div", { class: "class-before", hidden: true });
  const draw = () => (form.hidden = control.follow === null || control.follow.poll !== null);
  control.on(["follow"], draw, signal);
  draw();
  if (!isParticipant) offerBefore(before, ask, signal);
  return h("section", { class: "class-poll", "aria-label": "Ask the class" }, ofLesson, form, pollPart(control, signal), before);
}

/**
 * What was answered, to be shown again.
 *
 * @param {HTMLElement} place
 * @param {(poll: PollCreateRequest) => unknown} ask
 * @param {AbortSignal} signal
 */
async function offerBefore(place, ask, signal) {
  const kept = await polls.all().catch(() => []);
  if (signal.aborted || kept.length === 0) return;
  place.hidden = false;
  fill(
    place,
    h("details", {}, h("summary", {}, `Answered before (${kept.length})`), answeredList(kept.slice(0, MOST_BEFORE), { again: ({ id }) => ask({ kept: id }) })),
    h("a", { href: polls.csvAddress(), download: "" }, "Download all answers as CSV"),
  );
}

/** @param {ClassControl} control */
async function finish(control) {
  const { follow } = control;
  if (follow === null) return;
  const text = `${following(follow.followers)}. The link stops working, and the followers' own copies end, too.`;
  if (follow.followers === 0 || (await confirmLoss({ title: "End the class?", text, action: "End for all" }))) await control.end();
}
