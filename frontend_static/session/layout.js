/** Where the parts of a session stand within an element, before anything is in them. */

import { fill, h } from "../shared/dom.js";

/** @import { Properties } from "../shared/elements.js" */

/** @typedef {"scene"|"panel"|"branches"|"inspection"|"why"|"plots"|"readout"|"transport"|"scrubber"} Part */
/** @typedef {Partial<Record<Part|"status", HTMLElement>>} Places Beside a panel the line on how it goes stands above the plots. */

/** @type {readonly Part[]} */
export const PARTS = ["scene", "panel", "branches", "inspection", "why", "plots", "readout", "transport", "scrubber"];

/**
 * Make a place for each part. What is not asked for takes no room.
 *
 * @param {HTMLElement} element Loses what it held.
 * @param {readonly Part[]} parts
 * @returns {Places}
 */
export function arrange(element, parts) {
  const unknown = parts.filter((part) => !PARTS.includes(part));
  if (unknown.length > 0) throw new Error(`A session has the parts ${PARTS.join(", ")}, not ${unknown.join(", ")}`);
  /** @type {Places} */
  const places = {};
  /** @param {Part} part @param {"section"|"nav"|"div"} tag @param {Properties} properties */
  const place = (part, tag, properties) => {
    if (!parts.includes(part)) return null;
    return (places[part] = h(tag, { ...properties, data: { part } }));
  };
  // A page may show several, each in a section of its own, which an element that is not on the page yet names itself.
  const around = element.dataset.within ?? element.closest("section[aria-label]")?.getAttribute("aria-label");
  const named = (/** @type {string} */ label) => (around ? `${around}: ${label.toLowerCase()}` : label);
  const scene = place("scene", "section", { class: "scene", "aria-label": named("Scene") });
  const panel = place("panel", "section", { class: "controls", "aria-label": named("Parameters") });
  if (panel && parts.includes("readout")) places.status = h("section", { class: "status", "aria-label": named("This frame") });
  const side = [
    panel,
    places.status ?? null,
    place("branches", "nav", { class: "branches", "aria-label": named("Branches"), hidden: true }),
    place("inspection", "section", { class: "inspection", "aria-label": named("Look into the frame") }),
    place("why", "section", { class: "why", "aria-label": named("Why the target was lost") }),
    place("plots", "div", { class: "plots" }),
    place("readout", "section", { class: "readout" }),
  ].filter((it) => it !== null);
  const deck = [place("transport", "div", { class: "transport" }), place("scrubber", "div", {})].filter((it) => it !== null);
  const aside = side.length > 0 && h("aside", { class: "side", "aria-label": named("Plots") }, side);
  fill(
    element,
    h("div", { class: "session-view", role: "group", "aria-label": named("Session"), tabindex: -1 }, [
      (scene || aside) && h("div", { class: scene && aside ? "stage" : "stage alone" }, scene, aside),
      deck.length > 0 && h("footer", { class: "deck", "aria-label": named("Transport") }, deck),
    ]),
  );
  return places;
}
