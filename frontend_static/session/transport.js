/** The row of buttons above the scrubber: where the run is, and how fast it goes. */

import { fill, h, setText } from "../shared/dom.js";
import { speed as speedText } from "../shared/format.js";
import { icon } from "../shared/icons.js";
import { coalesce } from "../shared/timing.js";
import { ofRole } from "./series.js";
import { stopAtLoss } from "./stop_at_loss.js";

/** @import { IconName } from "../shared/icons.js" */

/** Less is not worth telling. */
const LATE_S = 0.5;
const NEXT_EVENT = "Go to the next event, such as an identity switch (E; with shift, to the one before)";
const LABELS = { pause: "Pause", replay: "Play again", play: "Play" };

/**
 * @param {HTMLElement} root
 * @param {import("./mount.js").View} view
 * @param {import("../shared/elements.js").Child[]} extras Further controls, at the right.
 */
export function transport(root, view, extras) {
  const { store } = view;
  /**
   * @param {IconName} name
   * @param {string} label
   * @param {() => void} run
   */
  const button = (name, label, run) =>
    h("button", { type: "button", class: "icon-only", title: label, "aria-label": label, on: { click: run } }, icon(name));
  const play = h("button", { type: "button", class: "primary play", on: { click: () => view.steering.toggle() } });
  const moves = [
    button("first", "First frame (home)", () => view.steering.first()),
    button("previous", "One frame back (left arrow)", () => view.steering.step(-1)),
    play,
    button("next", "One frame forward (right arrow)", () => view.steering.step(1)),
    button("last", "Newest frame (end)", () => view.steering.newest()),
  ];
  /** @type {HTMLSelectElement} */
  const speed = h(
    "select",
    { "aria-label": "Speed", title: "Speed ([ and ])", on: { change: () => view.steering.setSpeed(Number(speed.value)) } },
  );
  const counter = h("output", { class: "counter", "aria-label": "Frame" });
  fill(root, h("div", { class: "group" }, moves), speed, late(view), counter, stopAtLoss(view), h("span", { class: "spring" }), extras, landmarks(view));
  // A click must not leave the focus on a button, where the space bar would press it again instead of playing.
  root.addEventListener("mousedown", (event) => {
    if (!(event.target instanceof Element) || !event.target.closest("button")) return;
    event.preventDefault();
    /** @type {HTMLElement|null} */ (root.closest(".session-view"))?.focus({ preventScroll: true });
  });

  let shown = "";
  const draw = () => {
    const { session } = store;
    const { able, steering } = view;
    const still = steering.isAtEnd ? "replay" : "play";
    const look = steering.isPlaying ? "pause" : still;
    if (look !== shown) {
      shown = look;
      const label = LABELS[look];
      fill(play, icon(look), h("span", {}, label));
      play.title = `${label} (space)`;
    }
    for (const element of [...moves, speed]) element.disabled = !able;
    if (document.activeElement !== speed) choose(speed, steering);
    if (session === null) return;
    setText(counter, counted(session));
  };
  store.on(["position", "playing", "speed", "state", "connection", "history"], coalesce(draw, view.signal));
  draw(); // at once: no button is without a name
}

/**
 * What leads to where something has happened.
 *
 * @param {import("./mount.js").View} view
 */
function landmarks(view) {
  const { store, steering, signal } = view;
  const event = h(
    "button",
    { type: "button", class: "next-event", hidden: true, title: NEXT_EVENT, on: { click: () => steering.event(1) } },
    "Next event",
  );
  const loss = h(
    "button",
    { type: "button", class: "before-loss", title: "Go to before the target was lost (L)", on: { click: () => steering.beforeLoss() } },
    "Before the loss",
  );
  const draw = () => {
    event.hidden = store.session === null || ofRole(store.session, "event").length === 0;
    event.disabled = !view.able;
    loss.disabled = !view.able || !store.knowsLoss;
  };
  store.on(["session", "state", "connection", "history"], coalesce(draw, signal));
  draw();
  return [event, loss];
}

/**
 * How far a run that plays is behind its time, where it is computed more slowly than it shall play.
 *
 * @param {import("./mount.js").View} view
 */
function late({ store, signal }) {
  const element = h("span", { class: "hint", title: "Frames take longer to compute than they are shown", data: { role: "late" } });
  const draw = coalesce(() => {
    const { playing = false, behind_s: seconds = 0 } = store.session ?? {};
    setText(element, playing && seconds >= LATE_S ? `${seconds.toFixed(1)} s late` : "");
  }, signal);
  store.on(["behind_s", "playing"], draw);
  return element;
}

/**
 * Where the run stands; of a recording also where that is in the clip, as the form of the upload counts.
 *
 * @param {import("../shared/messages.js").SessionPublic} session
 */
function counted({ position, frames, recipe: { footage } }) {
  const frame = `frame ${position} / ${frames}`;
  return footage ? `${frame}, picture ${footage.start + position} of the clip` : frame;
}

/**
 * Show a speed among those that are offered; one that a client has set otherwise is offered as well.
 *
 * @param {HTMLSelectElement} select
 * @param {{speed: number, speeds: number[]}} steering
 */
function choose(select, { speed, speeds }) {
  for (const value of [...speeds, speed]) {
    const known = [...select.options].some((option) => Number(option.value) === value);
    if (!known) select.append(h("option", { value }, speedText(value)));
  }
  select.value = String(speed);
}
