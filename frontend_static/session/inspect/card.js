/** What is found in a frame, as figures: the likelihood with its parts, a particle, what a step was made of. */

import { gradient, viridis } from "../../shared/colours.js";
import { h } from "../../shared/dom.js";
import { number, quantity } from "../../shared/format.js";
import { partElement } from "./parts.js";

/** @import { InspectionPublic, ParticleFinding, StateValue } from "../../shared/messages.js" */

/**
 * @param {InspectionPublic} found
 * @returns {HTMLElement[]}
 */
export function card(found) {
  const { subject, title, parts, state, particle, update, frame } = found;
  if (subject === "gone") return [note("The particle has no descendants in this frame, or is too many frames away.")];
  if (title === "" && particle === null && update.length === 0) return [note("The tracker of this frame cannot be asked.")];
  return [
    title !== "" && headline(found),
    ...parts.map(partElement),
    particle && particleList(particle, frame),
    ...update.map(partElement),
    state.length > 0 && stateList(state),
  ].filter((it) => it instanceof HTMLElement);
}

/**
 * The range of the colours that lie over the picture.
 *
 * @param {[number, number]} scale
 */
export function colourBar([low, high]) {
  const title = "Log likelihood of the colours over the picture";
  const bar = h("i", { style: `background: ${gradient(viridis)}` });
  return h("div", { class: "colour-bar", title }, h("span", {}, number(low, 2)), bar, h("span", {}, number(high, 2)));
}

/** @param {InspectionPublic} found */
function headline({ subject, title, place, log_likelihood: value, impossible }) {
  const at = place === null ? "" : ` at ${place.map((each) => number(each)).join(", ")} px`;
  const figure = impossible ? "impossible" : number(value, 3);
  return h("p", { class: "headline" }, h("span", {}, "log likelihood "), h("strong", {}, figure), h("span", { class: "of" }, `${title}, ${subject}${at}`));
}

/**
 * @param {ParticleFinding} particle
 * @param {number} frame
 */
function particleList({ filter, number: place, count, weight, rank, sampler, ancestors, begins, descendants }, frame) {
  const line = (/** @type {string} */ title, /** @type {string} */ text) => [h("dt", {}, title), h("dd", {}, text)];
  return h(
    "dl",
    { class: "particle-list" },
    line("particle", `${place} of ${count}${filter && `, ${filter}`}`),
    line("weight", `${number(100 * weight, 3)} %, ${number(weight * count, 1)} times the mean`),
    line("rank", `${rank} of ${count}`),
    sampler !== "" && line("drawn by", sampler),
    line("ancestors", lineage(ancestors.length, begins, frame)),
    line("descendants", children(descendants)),
  );
}

/**
 * @param {number} known How many frames back they are known.
 * @param {number|null} begins
 * @param {number} frame
 */
function lineage(known, begins, frame) {
  if (begins === frame) return "none: it was drawn without a parent";
  if (known === 0) return "not known";
  return `followed back to frame ${frame - known}${begins === null ? "" : ", where its line begins"}`;
}

/** @param {readonly number[]} counts */
function children(counts) {
  if (counts.length === 0) return "not computed yet";
  const far = counts.length > 1 ? `, ${counts[counts.length - 1]} after ${counts.length} frames` : "";
  return `${counts[0]} in the next frame${far}`;
}

/** @param {readonly StateValue[]} state */
function stateList(state) {
  const rows = state.map(({ name, unit, value }) => [h("dt", {}, name), h("dd", {}, `${quantity(value, unit)} ${unit}`.trim())]);
  return h("details", {}, h("summary", {}, "All of the state"), h("dl", {}, rows));
}

/** @param {string} text */
function note(text) {
  return h("p", { class: "note" }, text);
}
