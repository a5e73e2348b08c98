/** The kinds of parts that a number is made of, each in a form that shows what was compared. */

import { h, svg } from "../../shared/dom.js";
import { number, quantity } from "../../shared/format.js";

/** @import { Amount, Contributions, Histograms, InspectionPublic, PatchesPublic, Residual } from "../../shared/messages.js" */

/** @typedef {InspectionPublic["parts"][number]} PartPublic */

/** Beyond so many deviations the mark stands at the edge. */
const MOST_SD = 4;
const HIGH = 40;

/**
 * @param {PartPublic} part
 * @returns {HTMLElement}
 */
export function partElement(part) {
  switch (part.kind) {
    case "amount":
      return amount(part);
    case "residual":
      return residual(part);
    case "histograms":
      return histograms(part);
    case "patches":
      return patches(part);
    default:
      return contributions(part);
  }
}

/** @param {Amount} part */
function amount({ title, value, unit, limit }) {
  const isBeyond = limit !== null && value !== null && value > limit;
  const words = limit === null ? "" : ` (${isBeyond ? "above" : "within"} ${quantity(limit, unit)})`;
  const figure = h("strong", {}, `${quantity(value, unit)} ${unit}`.trim(), words);
  return h("p", { class: "part-line", data: { beyond: String(isBeyond) } }, h("span", {}, title), figure);
}

/** @param {Residual} part */
function residual({ title, found, expected, sd, unit }) {
  const off = found === null || expected === null || !sd ? null : (found - expected) / sd;
  const place = off === null ? 50 : 50 + (50 * Math.max(-MOST_SD, Math.min(MOST_SD, off))) / MOST_SD;
  const figures = `${quantity(found, unit)} found, ${quantity(expected, unit)} expected ${unit}`.trim();
  const bar = h("div", { class: "deviation", "aria-hidden": "true" }, off !== null && h("i", { style: `left: ${place}%` }));
  const far = off === null ? "nothing found" : `${number(off, 1)} sd`;
  return h("div", { class: "part" }, h("p", { class: "part-line" }, h("span", {}, title), h("strong", {}, far)), bar, h("p", { class: "small" }, figures));
}

/** @param {Histograms} part */
function histograms({ title, expected, found, colours }) {
  const most = Math.max(...expected, ...found, 1e-9);
  const drawn = expected.map((share, bin) => {
    const [up, down] = [share, found[bin]].map((each) => (HIGH * each) / most);
    return up + down > 0 && svg("path", { d: `M${bin} ${HIGH}h1v${-up}h-1zM${bin} ${HIGH + 1}h1v${down}h-1z`, fill: colours[bin] ?? "currentColor" });
  });
  const chart = svg("svg", { viewBox: `0 0 ${expected.length} ${2 * HIGH + 1}`, preserveAspectRatio: "none", role: "img", "aria-label": title }, drawn);
  return h("figure", { class: "part histograms" }, h("figcaption", {}, title), chart, h("p", { class: "small" }, "expected above, found below"));
}

/** @param {PatchesPublic} part */
function patches({ title, expected, found }) {
  const patch = (/** @type {string|null} */ source, /** @type {string} */ words) =>
    source === null ? h("span", { class: "outside" }, "outside") : h("img", { src: source, alt: words });
  return h("figure", { class: "part patches" }, h("figcaption", {}, title), h("div", {}, patch(expected, "expected"), patch(found, "found")));
}

/** @param {Contributions} part */
function contributions({ title, columns, names, rows }) {
  const head = h("tr", {}, h("th", {}), columns.map((column) => h("th", { scope: "col" }, column)));
  const body = names.map((name, place) => h("tr", {}, h("th", { scope: "row" }, name), rows[place].map((value) => h("td", {}, number(value, 2)))));
  return h("div", { class: "part contributions" }, h("p", {}, title), h("table", {}, h("thead", {}, head), h("tbody", {}, body)));
}
