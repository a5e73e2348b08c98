/** The experiments as cards. */

import { REFERENCES } from "../shared/citations.js";
import { h } from "../shared/dom.js";
import { newSweep } from "../sweep/api.js";
import { linkTo } from "../shared/share_link.js";

/** @import { ExperimentPublic, PresetPublic } from "../shared/messages.js" */

/** So many presets stand on a card at once, the others in a fold. */
const SHOWN = 4;

/** @param {ExperimentPublic} experiment */
export function experimentCard(experiment) {
  const open = linkTo({ recipe: { experiment: experiment.id, tracker: experiment.default_tracker }, play: true });
  return h(
    "article",
    { class: "card", data: { experiment: experiment.id } },
    h("a", { href: open, class: "thumb", tabindex: -1, "aria-hidden": "true" }, thumbnail(experiment.thumbnail)),
    h("h3", {}, h("a", { href: open }, experiment.title)),
    h("p", { class: "question" }, experiment.question),
    presetList(experiment, experiment.presets.slice(0, SHOWN)),
    experiment.presets.length > SHOWN &&
      h(
        "details",
        { class: "more" },
        h("summary", {}, `${experiment.presets.length - SHOWN} more`),
        presetList(experiment, experiment.presets.slice(SHOWN)),
      ),
    h(
      "p",
      { class: "document" },
      h("a", { href: `${REFERENCES}#${encodeURIComponent(experiment.id)}` }, sourcesOf(experiment)),
      " · ",
      h("a", { href: newSweep({ experiment: experiment.id }) }, "Sweep over conditions"),
    ),
  );
}

/**
 * @param {ExperimentPublic} experiment
 * @param {PresetPublic[]} presets
 */
function presetList(experiment, presets) {
  return h(
    "ul",
    { class: "presets", "aria-label": "Presets" },
    presets.map((preset) => {
      const href = linkTo({ recipe: recipeOf(experiment, preset), play: true });
      return h("li", {}, h("a", { class: "button", title: preset.watch, href, data: { preset: preset.name } }, preset.title));
    }),
  );
}

/** @param {ExperimentPublic} experiment */
function sourcesOf({ references }) {
  return references.map(({ short }) => short).join("; ");
}

/**
 * @param {ExperimentPublic} experiment
 * @param {PresetPublic} preset
 */
function recipeOf(experiment, { tracker, seed, parameters }) {
  return { experiment: experiment.id, tracker, seed, timeline: [{ frame: 0, values: parameters }] };
}

/**
 * A picture that keeps its place while it loads, and a plain field if it cannot.
 *
 * @param {string} address
 */
export function thumbnail(address) {
  const image = h("img", { src: address, alt: "", loading: "lazy", width: 320, height: 240 });
  image.addEventListener("error", () => image.classList.add("missing"));
  return image;
}

/** Grey shapes where cards will be. */
export function skeletonCard() {
  const bones = ["thumb shimmer", "bone shimmer", "bone short shimmer"].map((shape) => h("div", { class: shape }));
  return h("div", { class: "card skeleton", "aria-hidden": "true" }, bones);
}
