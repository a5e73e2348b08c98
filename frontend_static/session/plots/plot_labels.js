/** What stands above a plot: its title, and the figures of the frame that is shown. */

import { h } from "../../shared/dom.js";
import { number, quantity, unitOf } from "../../shared/format.js";
import { curve, shares, valueOf } from "../history.js";

/**
 * The title.
 *
 * @param {object} plot As the experiment declares it.
 * @param {object} session
 * @param {import("../history.js").History} history
 * @returns {(string|Node)[]}
 */
export function heading(plot, session, history) {
  switch (plot.kind) {
    case "error":
      return [`${plot.title} ${unitOf(session)}`.trim()];
    case "sigma":
      return [`${plot.title}${gammas(session).length > 0 ? " | gamma" : ""} ${unitOf(session)}`.trim()];
    case "proposals":
      return [key("prediction", "prediction"), " ", key("observation", "observation")];
    case "features": {
      const known = history.some((row) => Number.isFinite(valueOf(row, plot.visible, 0)));
      return [`${plot.title} `, known ? key("hidden", "hidden") : key("lost", "not recognised")];
    }
    case "share":
      return [`${plot.title} ${plot.levels.map((level) => number(100 * level, 0)).join(" | ")} %`];
    default:
      return [`${plot.title} ${plot.unit}`.trim()];
  }
}

/** The figures of the frame that is shown. */
export function reading(plot, session, history) {
  const row = history.at(session.position);
  const unit = unitOf(session);
  const particles = curve.particles(row);
  switch (plot.kind) {
    case "error":
      return quantity(curve.error(row), unit);
    case "sigma":
      return [curve.sigma(row), ...gammas(session)].map((value) => quantity(value, unit)).join(" | ");
    case "sample size":
      return particles > 0 ? `${number(curve.ess(row), 0)} of ${particles}` : number(null);
    case "proposals":
      return particles > 0 ? `${curve.prediction(row)} | ${curve.observation(row)}` : number(null);
    case "band":
      return estimate(row, plot.series[0], plot.sd, plot.unit);
    case "features": {
      const values = session.features.map((_, place) => valueOf(row, plot.series[0], place));
      const mean = number(values.reduce((sum, value) => sum + value, 0) / values.length, 2);
      return mean === number(null) ? mean : `mean ${mean}`;
    }
    case "share":
      return `${plot.series.map((name) => number(100 * shares(history, name, session.position).at(-1), 0)).join(" | ")} %`;
    default:
      return "";
  }
}

/** A number of the series with its standard deviation. */
export function estimate(row, series, sd, unit) {
  const value = quantity(valueOf(row, series), unit);
  const spread = quantity(valueOf(row, sd), unit);
  return value === number(null) ? value : `${value} ± ${spread}`;
}

/** A word with the colour that it has in the plot. */
function key(token, word) {
  const swatch = h("span", { class: "key" });
  swatch.style.background = `var(--${token})`;
  return h("span", {}, swatch, word);
}

/** The thresholds in force in the frame that is shown. */
function gammas(session) {
  return session.thresholds
    .map(({ steps }) => steps.filter(({ frame }) => frame <= session.position).at(-1)?.value)
    .filter((value) => typeof value === "number");
}
