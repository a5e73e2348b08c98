/** The line "following": that this page goes with the lecturer's, and where that is. */

import { setText } from "../shared/dom.js";
import { speed as speedText } from "../shared/format.js";
import { coalesce } from "../shared/timing.js";

/** @import { Mounted } from "../session/mount.js" */
/** @import { ClassStream } from "./class_stream.js" */

const WORDS = { connecting: "Connecting", open: "Following", lost: "Reconnecting", full: "Waiting", over: "Ended" };

/**
 * @param {HTMLElement} place
 * @param {ClassStream} followed
 * @param {() => readonly Mounted[]} views
 * @returns {{watch: () => void}} To be told when other sessions are shown.
 */
export function followingLine(place, followed, views) {
  const draw = coalesce(() => {
    const session = views().at(0)?.store.session;
    const parts = [WORDS[followed.state]];
    if (session && followed.state === "open") {
      parts.push(`frame ${session.position} of ${session.frames}`);
      if (session.playing) parts.push(session.speed === 0 ? "playing as fast as possible" : `playing ${speedText(session.speed)}`);
    }
    setText(place, parts.join(" · "));
    place.dataset.state = followed.state;
  });
  const watch = () => {
    for (const { store } of views()) store.on(["position", "playing", "speed"], draw);
    draw();
  };
  followed.on(["state", "follow"], draw);
  draw();
  return { watch };
}
