/** One of the runs: what it is called, and a place for its picture. */

import { h } from "../shared/dom.js";
import { iconButton } from "../shared/icons.js";
import { linkTo } from "../shared/share_link.js";

/** @import { Outline } from "./compare.js" */

/**
 * @typedef {object} Column
 * @property {HTMLElement} element
 * @property {HTMLElement} place For the picture.
 * @property {(isFront: boolean) => void} setFront Say whether its bands and changes are those that are shown.
 */

/**
 * @param {Outline["runs"][number]} run
 * @param {number} place
 * @param {{choose: () => void, remove: (() => void)|null, position: () => number}} on
 * @returns {Column}
 */
export function column({ name, title, colour, recipe, first }, place, { choose, remove, position }) {
  const view = h("div", { class: "compared-view" });
  const swatch = h("span", { class: "swatch" });
  swatch.style.background = colour;
  const chip = h(
    "button",
    { type: "button", class: "chip", "aria-pressed": "false", title: `${title ?? name}. Show its losses, changes and limits below`, on: { click: choose } },
    swatch,
    h("strong", {}, String(place + 1)),
    h("span", {}, name),
  );
  const open = recipe && opener((frame) => linkTo({ recipe, position: first + frame }), position);
  const head = h("header", { class: "compared-head" }, h("h2", {}, chip), open, remove && iconButton("close", `Remove ${name}`, remove));
  const element = h("section", { class: "compared", "aria-label": `Run ${place + 1}, ${name}`, data: { place } }, head, view);
  element.style.setProperty("--run", colour);
  return { element, place: view, setFront: (isFront) => chip.setAttribute("aria-pressed", String(isFront)) };
}

/**
 * A link to the run as a session of its own, at the frame that is shown.
 *
 * @param {(frame: number) => string} address
 * @param {() => number} position
 */
function opener(address, position) {
  const link = h("a", { class: "link", href: address(0), title: "Open this run as a separate session, at this frame" }, "Open");
  // The runs have moved on by the time that somebody goes there.
  for (const type of /** @type {const} */ (["pointerenter", "focus", "click"])) {
    link.addEventListener(type, () => (link.href = address(position())));
  }
  return link;
}
