/** The switch that stops a run where its target is probably lost. The server decides, and says why it has stopped. */

import { fill, h, setText } from "../shared/dom.js";
import { percent } from "../shared/format.js";
import { coalesce } from "../shared/timing.js";
import { ofRole } from "./series.js";

/** From which probability on it may stop. */
const LIMITS = [0.5, 0.8, 0.95];
/** What each kind of run can tell: its label, and why it stops. */
const SCENE = ["Stop when probably lost", "Stop playing in the frame in which the tracker has probably lost its target, by its own numbers"];
const RECORDING = ["Stop when lost", "Stop playing where a mark or the tracker itself says that the target is lost. P(lost) is not calibrated on recordings."];

/**
 * The switch with its limit, and what the server says.
 *
 * @param {import("./mount.js").View} view
 * @returns {HTMLElement} Hidden in a scene whose trackers have no such probability, and where nothing can be changed.
 */
export function stopAtLoss(view) {
  const { store, steering, signal } = view;
  const ask = () => steering.stopAt(box.checked ? Number(limit.value) : null);
  /** @type {HTMLInputElement} */
  const box = h("input", { type: "checkbox", on: { change: ask } });
  /** @type {HTMLSelectElement} */
  const limit = h("select", { "aria-label": "Probability of being lost from which on it stops", on: { change: ask } });
  fill(limit, LIMITS.map((value) => h("option", { value }, percent(value))));
  // What the server says takes the place of the label, so that nothing moves.
  const said = h("span", { role: "status" }, SCENE[0]);
  const label = h("label", { title: SCENE[1] }, box, said);
  const element = h("div", { class: "stop-at-loss" }, label, limit);
  const draw = coalesce(() => {
    const { session } = store;
    const isRecording = Boolean(session?.recipe.footage);
    const [words, why] = isRecording ? RECORDING : SCENE;
    element.hidden = session === null || store.isReadOnly || !(isRecording || ofRole(session, "loss_probability").length > 0);
    label.title = limit.title = why;
    const at = session?.stop_at ?? null;
    box.checked = at !== null;
    box.disabled = limit.disabled = !view.able;
    limit.hidden = at === null || isRecording;
    if (at !== null) choose(limit, at);
    setText(said, session?.stopped || words);
  }, signal);
  store.on(["session", "stop_at", "stopped", "state", "connection"], draw);
  draw();
  return element;
}

/**
 * Show a limit among those that are offered; one that a client has set otherwise is offered as well.
 *
 * @param {HTMLSelectElement} select
 * @param {number} value
 */
function choose(select, value) {
  if (![...select.options].some((option) => Number(option.value) === value)) select.append(h("option", { value }, percent(value)));
  select.value = String(value);
}
