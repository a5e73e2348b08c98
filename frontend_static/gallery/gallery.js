/** The start page: the tour, a drop zone for a video, and the experiments as cards, by family. */

import { messageOf, request } from "../shared/api.js";
import { CompilationMeter, followCompiling, inSentenceCase } from "../shared/compiling.js";
import { build, CopyButton } from "../shared/dom.js";
import { isTourKnown, Loaded, showPage, tourLink } from "../shared/page.js";
import { linkTo, newSweep, presetRecipe } from "../shared/share_link.js";
import { GLOSSARY, REFERENCES } from "../shared/terms.js";
import { DropZone } from "../upload/drop_zone.js";
import { TargetForm } from "../upload/form.js";
import { h, html, signal, useEffect, useSignal } from "../vendor/preact.js";

/** @import { CompilationPublic, ExperimentPublic, FilterPublic, Preset } from "../shared/messages.js" */

const UPLOAD = /^#upload\/(.+)$/;
/** The page whose scripts are prefetched while a person looks at this page. */
const SESSION = "session/new";
/** Commands that the server writes into the page, with the path of its program. */
const COMMANDS = document.documentElement.dataset.commands ?? "";
/** Most presets shown on a card; the others are folded. */
const SHOWN = 2;
const BONE = html`<div class="card" aria-hidden="true">
  <div class="thumb shimmer"></div><div class="bone shimmer"></div><div class="bone short shimmer"></div>
</div>`;

/** The experiments, once they are known. */
const experiments = signal(/** @type {ExperimentPublic[]|null} */ (null));
/** Progress of compiling; null if it is done or unknown. */
const compilation = signal(/** @type {CompilationPublic|null} */ (null));
/** Problems of other packages' experiments. */
const problems = signal(/** @type {readonly string[]} */ ([]));
/** The upload whose target is to be marked. The address names it, so that a reload asks again. */
const upload = signal(uploadOfAddress());

async function load() {
  const listed = (experiments.value = await request("GET experiments"));
  findProblems().then(ahead);
  return h(Families, { listed });
}

async function findProblems() {
  try {
    problems.value = (await request("GET plugins")).flatMap(({ problem }) => problem ?? []);
  } catch (error) {
    problems.value = [`Couldn't load the experiments of other packages: ${messageOf(error)}`];
  }
}

/** Prefetch scripts; browsers reuse them once, for some minutes, without asking the server again. */
async function ahead() {
  try {
    const answer = await fetch(SESSION);
    const page = new DOMParser().parseFromString(await answer.text(), "text/html");
    const modules = [...page.querySelectorAll("link[rel=modulepreload]")].map((link) => link.getAttribute("href"));
    for (const script of modules) document.head.append(build("link", { rel: "prefetch", href: script, as: "script" }));
  } catch {
    // Without prefetching, they are loaded when they are needed.
  }
}

/** The upload named by the address, still encoded. */
function uploadOfAddress() {
  return UPLOAD.exec(location.hash)?.[1];
}

function leave() {
  history.replaceState(null, "", location.pathname);
  upload.value = undefined;
}

/** The whole page. */
function Start() {
  const listed = experiments.value;
  const id = listed ? upload.value : undefined;
  const isAsking = id !== undefined;
  return html`
    <div class="welcome" hidden=${isAsking}>
      ${listed && h(TourOffer, { listed })}
      <section aria-label="Your own video">${h(DropZone, {})}</section>
      ${h(OwnFilterOffer, {})}
    </div>
    ${listed && id && h(Asked, { key: id, id, listed })}
    <div data-part="browse" hidden=${isAsking}>
      <h2>Experiments</h2>
      ${h(Compiling, {})}
      <div class="families" data-part="experiments">
        ${h(Loaded, { load, failed: "Couldn't load the experiments", bones: [BONE, BONE] })}
      </div>
      <div role="status" data-part="plugins">
        ${problems.value.length > 0 && html`<ul class="problems">${problems.value.map((problem) => html`<li>${problem}</li>`)}</ul>`}
      </div>
    </div>
  `;
}

/** @param {{id: string, listed: ExperimentPublic[]}} props The form that asks for the target in an upload. */
function Asked({ id, listed }) {
  const find = () => request("GET uploads/{upload}", { upload: decodeURIComponent(id) });
  const form = async () => h(TargetForm, { upload: await find(), experiments: listed, leave });
  const unknown = { title: "Upload not found", action: { label: "All experiments", run: leave } };
  return h(Loaded, { load: form, failed: "Couldn't open the upload", unknown });
}

/** The offer of the tour: large for a first visitor, one line for others; empty without a tour.
 *
 * @param {{listed: ExperimentPublic[]}} props
 */
function TourOffer({ listed }) {
  const href = tourLink(listed);
  if (href === null) return null;
  if (isTourKnown()) {
    return html`<section class="tour-offer known" aria-label="Guided tour"><a href=${href} data-role="tour">Take the guided tour again</a></section>`;
  }
  return html`<section class="tour-offer" aria-label="Guided tour">
    <h2>New here? See a tracker lose its target, and why</h2>
    <p class="hint">Three clicks, about a minute. You can leave the tour at any time.</p>
    <footer><a class="button primary" href=${href} data-role="tour">Take the tour</a><span class="hint">or choose an experiment below</span></footer>
  </section>`;
}

/** Commands for a first own filter, or the files that the server was started with. */
function OwnFilterOffer() {
  const files = useSignal(/** @type {FilterPublic[]} */ ([]));
  useEffect(() => void request("GET filters").then((found) => (files.value = found), () => {}), []);
  const open = (/** @type {FilterPublic} */ { name, file, experiment }) =>
    html`<a class="button primary" href=${linkTo({ recipe: { experiment, tracker: name } })}>Open ${file}</a>`;
  const begin = html`<div class="own-commands">
    <pre>${COMMANDS}</pre>
    ${h(CopyButton, { label: "Copy", text: COMMANDS, what: "the commands" })}
  </div>`;
  const hasFiles = files.value.length > 0;
  return html`<section class="own-filter" aria-label="Your own filter">
    <h2>${hasFiles ? "Your filter" : "Write your own filter"}</h2>
    <p class="hint">One Python file. Save it, and the running session continues with the new code.</p>
    ${hasFiles ? html`<footer>${files.value.map(open)}</footer>` : begin}
  </section>`;
}

/** @param {{listed: ExperimentPublic[]}} props The families, in the order of their first experiments. */
function Families({ listed }) {
  const names = [...new Set(listed.map(({ family }) => family))];
  return names.map((name) => {
    const members = listed.filter(({ family }) => family === name);
    // A family takes as many columns as it has members, so that two small ones share a row.
    return html`<section class="family" aria-label=${name} data-family=${name} style=${{ "--members": members.length }}>
      <h3>${name}</h3>
      <div class="cards">${members.map((experiment) => h(Card, { experiment }))}</div>
    </section>`;
  });
}

/** @param {{experiment: ExperimentPublic}} props */
function Card({ experiment }) {
  const { id, title, question, presets, references, thumbnail } = experiment;
  const open = linkTo({ recipe: { experiment: id, tracker: experiment.default_tracker }, play: true });
  const compiling = compilation.value;
  const waits = compiling !== null && !compiling.usable.includes(id);
  return html`<article class=${waits ? "card waits" : "card"} data-experiment=${id}>
    ${thumbnail && html`<a href=${open} class="thumb" tabindex="-1" aria-hidden="true"><img src=${thumbnail} alt="" /></a>`}
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

/** Progress of compiling; it disappears when compiling is done. */
function Compiling() {
  const now = compilation.value;
  const note = now && html`<p class="note compiling">${inSentenceCase(now.sentence)}. ${h(CompilationMeter, now)}</p>`;
  return html`<div role="status" data-part="compiling">${note}</div>`;
}

addEventListener("hashchange", () => (upload.value = uploadOfAddress()));
followCompiling((now) => (compilation.value = now)).catch(() => {}).then(() => (compilation.value = null));
addEventListener("pageshow", (event) => event.persisted && location.reload());
const links = html`<a class="link" href=${GLOSSARY}>Glossary</a><a class="link" href=${REFERENCES}>References</a>`;
showPage("start", "experiments", Start, links);
