/** The page of somebody who follows a class: what the lecturer shows, as the lecturer shows it, to be looked at. */

import { dialogIsOpen } from "../shared/dialog.js";
import { fill, h, part, setText } from "../shared/dom.js";
import { notice } from "../shared/notice.js";
import { later } from "../shared/timing.js";
import { ClassStream } from "./class_stream.js";
import { forkButton } from "./fork.js";
import { followingLine } from "./following_line.js";
import { PollView } from "../lecturer/poll.js";
import { ClassView } from "./class_view.js";

const SKELETON_AFTER_MS = 200;
const { signal } = new AbortController();

const followed = new ClassStream(signal);
const place = part("shown");
const waiting = later(() => fill(place, h("div", { class: "follow-wait" }, h("div", { class: "shimmer" }))), SKELETON_AFTER_MS);
followed.on(["follow"], waiting);
const shown = new ClassView(place, followed, () => line.watch());
const line = followingLine(part("following"), followed, () => shown.views);
forkButton(part("fork"), followed, () => shown.views);
poll();
followed.on(["follow"], () => {
  const { title } = /** @type {NonNullable<ClassStream["follow"]>} */ (followed.follow);
  setText(part("title"), title);
  document.title = `${title} · pftrack`;
});
followed.on(["state"], () => {
  const { state, sentence } = followed;
  part("disconnected").hidden = state !== "lost" || followed.follow === null;
  if (state === "full") say("This class is full", `${sentence} This page joins automatically as soon as there is a place.`);
  if (state === "over") say("The class has ended", sentence);
  part("foot").hidden = state === "full" || state === "over";
});

/**
 * Say why there is nothing to be seen.
 *
 * @param {string} title
 * @param {string} sentence
 */
function say(title, sentence) {
  waiting();
  shown.clear();
  fill(place, notice(title, sentence, null, { inline: true }));
}

/** Answer by a click, or by the number of the answer. */
function poll() {
  const view = new PollView({ vote: (answer) => followed.vote(answer) });
  part("poll").append(view.element);
  const draw = () => {
    const { poll: asked } = followed;
    part("poll").hidden = asked === null;
    if (asked !== null) view.show(asked, { own: followed.answered });
  };
  followed.on(["follow"], draw);
  draw();
  document.addEventListener("keydown", (event) => {
    if (!/^[1-8]$/.test(event.key) || event.ctrlKey || event.metaKey || event.altKey || dialogIsOpen()) return;
    followed.vote(Number(event.key) - 1);
  });
}
