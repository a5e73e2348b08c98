/** The experiments as cards, those of one family side by side. */

import { REFERENCES } from "../shared/citations.js";
import { h } from "../shared/dom.js";
import { linkTo, presetRecipe } from "../shared/share_link.js";
import { thumbnail } from "../shared/thumbnail.js";
import { newSweep } from "../shared/share_link.js";

/** @import { ExperimentPublic, PresetPublic } from "../shared/messages.js" */

/** So many presets stand on a card at once, the others in a fold. */
const SHOWN = 2;

/**
 * The families in the order in which their first experiments come.
 *
 * @param {ExperimentPublic[]} experiments
 */
export function families(experiments) {
  const names = [...new Set(experiments.map(({ family }) => family))];
  return names.map((name) => {
    const members = experiments.filter(({ family }) => family === name);
    const cards = h("div", { class: "cards" }, members.map(experimentCard));
    const section = h("section", { class: "family", "aria-label": name, data: { family: name } }, h("h3", {}, name), cards);
    // A family takes as many columns as it has members, so that two small ones share a row.
    section.style.setProperty("--members", String(members.length));
    return section;
  });
}

/** @param {ExperimentPublic} experiment */
function experimentCard(experiment) {
  const open = linkTo({ recipe: { experiment: experiment.id, tracker: experiment.default_tracker }, play: true });
  return h(
    "article",
    { class: "card", data: { experiment: experiment.id } },
    h("a", { href: open, class: "thumb", tabindex: -1, "aria-hidden": "true" }, thumbnail(experiment.thumbnail)),
    h("p", { class: "hint waiting" }, "Compiling; a session waits until it is done."),
    h("h4", {}, h("a", { href: open }, experiment.title)),
    h("p", { class: "question" }, experiment.question),
    presetList(experiment, experiment.presets.slice(0, SHOWN)),
    experiment.presets.length > SHOWN &&
      h(
        "details",
        { class: "more" },
        h("summary", {}, `${experiment.presets.length - SHOWN} more to try`),
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
      const href = linkTo({ recipe: presetRecipe(experiment, preset), play: true });
      return h("li", {}, h("a", { class: "button", title: preset.watch, href, data: { preset: preset.name } }, preset.title));
    }),
  );
}

/** @param {ExperimentPublic} experiment */
function sourcesOf({ references }) {
  return references.map(({ short }) => short).join("; ");
}

/** Grey shapes where cards will be. */
export function skeletonCard() {
  const bones = ["thumb shimmer", "bone shimmer", "bone short shimmer"].map((shape) => h("div", { class: shape }));
  return h("div", { class: "card skeleton", "aria-hidden": "true" }, bones);
}
