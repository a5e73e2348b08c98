/** The "this frame" box: the numbers behind the picture. */

import { fill, h, setText } from "./dom.js";
import { number, quantity, unitOf } from "./format.js";
import { curve } from "./history.js";
import { coalesce } from "./pace.js";

/**
 * @param {HTMLElement} root
 * @param {import("./store.js").Store} store
 */
export function readout(root, store) {
  const lines = {};
  const line = (name, label) => {
    lines[name] = h("dd", {});
    return [h("dt", {}, label), lines[name]];
  };
  const verdict = h("p", { class: "verdict" });
  fill(
    root,
    h("h2", {}, "This frame"),
    verdict,
    h(
      "dl",
      {},
      line("estimate", "estimate"),
      line("error", "error"),
      line("sigma", "sigma"),
      line("particles", "particles"),
      line("proposal", "proposal"),
      line("evidence", "log evidence"),
      line("time", "step"),
    ),
  );
  const draw = coalesce(() => {
    const session = store.session;
    if (session === null) return;
    const row = store.history.at(session.position);
    const unit = unitOf(session);
    const withUnit = (text) => (unit && text !== "–" ? `${text} ${unit}` : text);
    const total = curve.prediction(row) + curve.observation(row);
    setText(lines.estimate, withUnit(row?.estimate?.map((value) => quantity(value, unit)).join(", ") ?? "–"));
    setText(lines.error, withUnit(quantity(curve.error(row), unit)));
    setText(lines.sigma, withUnit(row?.sigma?.map((value) => quantity(value, unit)).join(", ") ?? "–"));
    setText(lines.particles, row ? (total > 0 ? `${total}, ESS ${number(curve.ess(row), 0)}` : "none") : "–");
    setText(lines.proposal, row ? proposal(row) : "–");
    setText(lines.evidence, number(row?.log_evidence, 2));
    setText(lines.time, row ? `${number(row.step_ms, 2)} ms` : "–");
    const [words, kind] = state(store.history, session.position);
    setText(verdict, words);
    verdict.dataset.kind = kind;
  });
  store.on("session position history branches", draw);
}

function proposal(row) {
  switch (row.proposal) {
    case "mixed":
      return `mixed ${row.prediction_count} | ${row.observation_count}`;
    case "none":
      return "none";
    default:
      return `${row.proposal} ${row.prediction_count + row.observation_count}`;
  }
}

/** One line that says how it goes. */
function state(history, position) {
  const row = history.at(position);
  if (!row) return ["not computed yet", "unknown"];
  if (row.lost === true) {
    let since = position;
    while (since > 0 && history.at(since - 1)?.lost === true) since -= 1;
    return [`lost since ${since}`, "lost"];
  }
  if (row.hidden === true) return ["hidden", "hidden"];
  if (row.lost === false) return ["on target", "good"];
  return [row.error === null ? "truth not known" : "", "unknown"];
}
