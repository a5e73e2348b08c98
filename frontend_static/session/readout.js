/** The "this frame" box: the numbers behind the picture, as the experiment declares them. */

import { fill, h, setText } from "../shared/dom.js";
import { number, quantity, unitOf } from "../shared/format.js";
import { coalesce } from "../shared/timing.js";
import { curve, valueOf } from "./history.js";
import { estimate } from "./plots/plot_labels.js";

/**
 * @param {HTMLElement} root
 * @param {import("./mount.js").Mounted} view
 */
export function readout(root, { store, signal }) {
  const verdict = h("p", { class: "verdict" });
  const list = h("dl", {});
  fill(root, h("h2", { class: "visually-hidden" }, "This frame"), verdict, list);
  let declared = [];
  const draw = coalesce(() => {
    const { session, history } = store;
    if (session === null) return;
    if (session.readings.length !== declared.length) {
      declared = session.readings;
      fill(list, declared.map(({ title }) => [h("dt", {}, title), h("dd", {})]));
    }
    const row = history.at(session.position);
    declared.forEach((reading, place) => setText(list.children[2 * place + 1], words(reading, row, session)));
    const [text, kind] = state(history, session);
    setText(verdict, text);
    verdict.dataset.kind = kind;
  }, signal);
  store.on("session position history branches", draw);
}

function words({ kind, unit, series, sd }, row, session) {
  if (!row) return number(null);
  const own = unitOf(session);
  const several = (values) => values.map((value) => quantity(value, own)).join(", ");
  switch (kind) {
    case "estimate":
      return withUnit(several(row.estimate), own);
    case "sigma":
      return withUnit(several(row.sigma), own);
    case "error":
      return withUnit(quantity(curve.error(row), own), own);
    case "particles":
      return curve.particles(row) > 0 ? `${curve.particles(row)}, ESS ${number(curve.ess(row), 0)}` : "none";
    case "proposal":
      return proposal(row);
    case "evidence":
      return number(row.log_evidence, 2);
    case "time":
      return `${number(row.step_ms, 2)} ms`;
    case "value":
      return withUnit(estimate(row, series, sd, unit), unit);
    case "count": {
      const ones = session.features.filter((_, place) => valueOf(row, series, place) === 1);
      return `${ones.length} of ${session.features.length}`;
    }
    default:
      return "";
  }
}

function withUnit(text, unit) {
  return unit && text !== number(null) ? `${text} ${unit}` : text;
}

function proposal(row) {
  switch (row.proposal) {
    case "mixed":
      return `mixed ${row.prediction_count} | ${row.observation_count}`;
    case "none":
      return "none";
    default:
      return `${row.proposal} ${curve.particles(row)}`;
  }
}

/** One line that says how it goes. */
function state(history, { position, target, frame_rate_hz: frameRate }) {
  const row = history.at(position);
  if (!row) return ["not computed yet", "unknown"];
  if (row.searching) return [`no ${target} since ${since(history, position, "searching")}, looking for it`, "lost"];
  // For a second of the run, so that it can be read.
  for (let frame = position - 1; frame >= Math.max(0, position - frameRate); frame -= 1) {
    if (history.at(frame)?.searching) return [`${target} found again`, "good"];
  }
  if (row.lost) return [`lost since ${since(history, position, "lost")}`, "lost"];
  if (row.hidden === true) return ["hidden", "hidden"];
  if (row.lost === false) return ["on target", "good"];
  return [row.error === null ? "truth not known" : "", "unknown"];
}

/** The first of the frames up to this one that all say so. */
function since(history, position, what) {
  let first = position;
  while (history.at(first - 1)?.[what]) first -= 1;
  return first;
}
