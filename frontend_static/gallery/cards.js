/** The experiments as cards, those of one family side by side. */

import { REFERENCES } from "../shared/citations.js";
import { linkTo, newSweep, presetRecipe } from "../shared/share_link.js";
import { Thumbnail } from "../shared/thumbnail.js";
import { h, html } from "../vendor/preact.js";

/** @import { CompilationPublic, ExperimentPublic, Preset } from "../shared/messages.js" */

/** So many presets stand on a card at once, the others in a fold. */
const SHOWN = 2;

/**
 * The families in the order in which their first experiments come.
 *
 * @param {{experiments: ExperimentPublic[], compilation: CompilationPublic|null}} props `compilation` is null where it is not known.
 */
export function Families({ experiments, compilation }) {
  const names = [...new Set(experiments.map(({ family }) => family))];
  return names.map((name) => {
    const members = experiments.filter(({ family }) => family === name);
    // A family takes as many columns as it has members, so that two small ones share a row.
    return html`<section class="family" aria-label=${name} data-family=${name} style=${{ "--members": members.length }}>
      <h3>${name}</h3>
      <div class="cards">${members.map((experiment) => h(Card, { experiment, compilation }))}</div>
    </section>`;
  });
}

/** @param {{experiment: ExperimentPublic, compilation: CompilationPublic|null}} props */
function Card({ experiment, compilation }) {
  const { id, title, question, presets, references, thumbnail } = experiment;
  const open = linkTo({ recipe: { experiment: id, tracker: experiment.default_tracker }, play: true });
  const waits = compilation !== null && !compilation.finished && !compilation.usable.includes(id);
  const isDrawn = compilation === null || compilation.finished || compilation.ready.includes(id);
  return html`<article class=${waits ? "card waits" : "card"} data-experiment=${id}>
    <a href=${open} class="thumb" tabindex="-1" aria-hidden="true">${h(Thumbnail, { key: `${isDrawn}`, address: thumbnail })}</a>
    ${waits && html`<p class="hint waiting">Compiling; a session waits until it is done.</p>`}
    <h4><a href=${open}>${title}</a></h4>
    <p class="question">${question}</p>
    ${presetList(experiment, presets.slice(0, SHOWN))}
    ${presets.length > SHOWN && html`<details class="more">
      <summary>${presets.length - SHOWN} more to try</summary>
      ${presetList(experiment, presets.slice(SHOWN))}
    </details>`}
    <p class="document">
      <a href=${`${REFERENCES}#${encodeURIComponent(id)}`}>${references.map(({ short }) => short).join("; ")}</a>
      ${" · "}
      <a href=${newSweep({ experiment: id })}>Sweep over conditions</a>
    </p>
  </article>`;
}

/**
 * @param {ExperimentPublic} experiment
 * @param {Preset[]} presets
 */
function presetList(experiment, presets) {
  const links = presets.map((preset) => {
    const href = linkTo({ recipe: presetRecipe(experiment, preset), play: true });
    return html`<li><a class="button" title=${preset.watch} href=${href} data-preset=${preset.name}>${preset.title}</a></li>`;
  });
  return html`<ul class="presets" aria-label="Presets">${links}</ul>`;
}
