/** The "this frame" box: the numbers behind the picture, as the experiment declares them. */

import { fill, h, setText } from "../shared/dom.js";
import { isParticipant } from "../shared/participant.js";
import { explain } from "../shared/terms.js";
import { coalesce } from "../shared/timing.js";
import { measures } from "./measures.js";
import { isMeasured, state, words } from "./readings.js";

/** @import { Reading } from "../shared/messages.js" */

/**
 * @param {HTMLElement} root
 * @param {Pick<import("./mount.js").View, "store"|"signal">} view
 * @param {HTMLElement|null} [ask] Beside the words on how it goes.
 */
export function readout(root, view, ask = null) {
  const { store, signal } = view;
  const verdict = h("p", { class: "verdict" });
  const look = h("p", { class: "look", hidden: true });
  const doubts = h("div", { class: "doubts" });
  const list = h("dl", {});
  fill(root, h("h2", { class: "visually-hidden" }, "This frame"), h("div", { class: "verdict-row" }, verdict, ask), look, list, doubts);
  measures(root, view);
  /** @type {Reading[]} */
  let readings = [];
  /** @type {{title: HTMLElement, value: HTMLElement}[]} */
  let lines = [];
  /** @type {Record<string, string> | null} */
  let said = null;
  const draw = coalesce(() => {
    const { session, history } = store;
    if (session === null) return;
    if (session.readings.length !== readings.length) {
      readings = session.readings;
      lines = readings.map(({ title }) => ({ title: h("dt", {}, title), value: h("dd", {}) }));
      fill(list, lines.map(({ title, value }) => [title, value]));
      for (const { title } of lines) explain(title, { experiment: session.recipe.experiment });
    }
    const row = history.at(session.position);
    readings.forEach((reading, place) => {
      const { title, value } = lines[place];
      // A line of which the method has nothing at all is left out; one that is not known in this frame stays in its place.
      title.hidden = value.hidden = row !== undefined && !isMeasured(reading, row, session, history);
      setText(value, words(reading, row, session));
    });
    const [text, kind] = state(history, session);
    setText(verdict, text);
    verdict.dataset.kind = kind;
    setText(look, session.look);
    look.hidden = session.look === "";
    if (session.doubts !== said) {
      said = session.doubts;
      fill(doubts, Object.values(said).map((why) => [`${why} `, !isParticipant && h("a", { href: "help/explanation/calibration.html" }, "About bands"), " "]));
    }
  }, signal);
  store.on(["position", "branch", "history", "doubts", "look"], draw);
}
