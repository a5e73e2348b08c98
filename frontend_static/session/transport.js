/** The row of buttons above the scrubber: where the run is, and how fast it goes. */

import { SPEEDS } from "./commands.js";
import { fill, h, setText } from "../shared/dom.js";
import { speed as speedText } from "../shared/format.js";
import { icon } from "../shared/icons.js";
import { beforeLoss } from "./history.js";
import { coalesce } from "../shared/timing.js";

/**
 * @param {HTMLElement} root
 * @param {import("./store.js").Store} store
 * @param {import("./commands.js").Commands} commands
 * @param {Node[]} extras Further controls, at the right.
 */
export function transport(root, store, commands, extras) {
  const button = (name, label, run) => {
    const element = h("button", { type: "button", class: "icon-only", title: label, "aria-label": label, on: { click: run } }, icon(name));
    return element;
  };
  const play = h("button", { type: "button", class: "primary play", on: { click: () => commands.toggle() } });
  const moves = [
    button("first", "First frame (home)", () => commands.first()),
    button("previous", "One frame back (left arrow)", () => commands.step(-1)),
    play,
    button("next", "One frame on (right arrow)", () => commands.step(1)),
    button("last", "Newest frame (end)", () => commands.newest()),
  ];
  const speed = h(
    "select",
    { "aria-label": "Speed", title: "Speed ([ and ])", on: { change: () => commands.speed(Number(speed.value)) } },
    SPEEDS.map((value) => h("option", { value }, speedText(value))),
  );
  const counter = h("output", { class: "counter", "aria-label": "Frame" });
  const loss = h(
    "button",
    { type: "button", title: "Go to before the target was lost (L)", on: { click: () => commands.beforeLoss() } },
    "Before the loss",
  );
  fill(root, h("div", { class: "group" }, moves), speed, counter, h("span", { class: "spring" }), extras, loss);
  // A click must not leave the focus on a button, where the space bar would press it again instead of playing.
  root.addEventListener("mousedown", (event) => {
    if (event.target.closest("button")) event.preventDefault();
  });

  let shown = "";
  const draw = coalesce(() => {
    const session = store.session;
    const able = session !== null && commands.able && store.connection === "open";
    const look = session === null ? "play" : session.playing ? "pause" : session.position >= session.frames - 1 ? "replay" : "play";
    if (look !== shown) {
      shown = look;
      const label = { pause: "Pause", replay: "Play again", play: "Play" }[look];
      fill(play, icon(look), h("span", {}, label));
      play.title = `${label} (space)`;
    }
    for (const element of [...moves, speed]) element.disabled = !able;
    loss.disabled = !able || beforeLoss(store.history, session.position) === null;
    if (document.activeElement !== speed) choose(speed, session?.speed ?? 1);
    if (session === null) return;
    setText(counter, `frame ${session.position} / ${session.frames}`);
  });
  store.on("session position connection history", draw);
  draw();
}

function choose(select, value) {
  const known = [...select.options].find((option) => Number(option.value) === value);
  if (!known && Number.isFinite(value)) select.append(h("option", { value }, speedText(value)));
  select.value = String(value);
}
