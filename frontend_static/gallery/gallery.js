/** The start page: where to begin, a place for one's own video, and the experiments by family. */

import { ahead } from "./prefetch.js";
import { api, messageOf } from "../shared/api.js";
import { REFERENCES } from "../shared/citations.js";
import { Families } from "./cards.js";
import { compilationMeter, followCompiling, inSentenceCase } from "../shared/compiling.js";
import { h as element } from "../shared/dom.js";
import { OwnFilterOffer, TourOffer } from "./offers.js";
import { Failed, Made, showPage } from "../shared/page.js";
import { GLOSSARY } from "../shared/terms.js";
import { toast } from "../shared/toast.js";
import { DropZone } from "../upload/drop_zone.js";
import { TargetForm } from "../upload/form.js";
import { h, html, signal, useEffect } from "../vendor/preact.js";

/** @import { CompilationPublic, ExperimentPublic, UploadPublic } from "../shared/messages.js" */

const UPLOAD = /^#upload\/(.+)$/;
/** Where the saved runs stood before. */
const RUN = /^#run-\w+$/;
const BONE = html`<div class="late card skeleton" aria-hidden="true">
  <div class="thumb shimmer"></div><div class="bone shimmer"></div><div class="bone short shimmer"></div>
</div>`;

/** The experiments; or why they cannot be listed; or nothing yet. */
const experiments = signal(/** @type {ExperimentPublic[]|string|null} */ (null));
const compilation = signal(/** @type {CompilationPublic|null} */ (null));
/** What is wrong with the experiments of other packages. */
const problems = signal(/** @type {readonly string[]} */ ([]));
/** The upload in which a target is asked for, as the address says; so a reload keeps the place. */
const upload = signal(/** @type {UploadPublic|null} */ (null));

async function load() {
  try {
    experiments.value = await api.experiments();
  } catch (error) {
    experiments.value = messageOf(error);
    return;
  }
  await Promise.all([findProblems(), findUpload()]);
  await ahead();
}

async function findProblems() {
  try {
    problems.value = (await api.plugins()).flatMap(({ problem }) => problem ?? []);
  } catch (error) {
    problems.value = [`The experiments of other packages could not be listed: ${messageOf(error)}`];
  }
}

/** The upload that the address names, as it stands there. */
function uploadOfAddress() {
  return UPLOAD.exec(location.hash)?.[1];
}

async function findUpload() {
  const id = uploadOfAddress();
  upload.value = null;
  if (!id) return;
  try {
    const found = await api.upload(decodeURIComponent(id));
    if (id === uploadOfAddress()) upload.value = found;
  } catch (error) {
    if (id !== uploadOfAddress()) return;
    toast(messageOf(error), { kind: "error" });
    leave();
  }
}

function leave() {
  history.replaceState(null, "", location.pathname);
  findUpload();
}

/** All of the page. */
function Start() {
  useEffect(() => void load(), []);
  const known = experiments.value;
  const listed = typeof known === "string" ? null : known;
  const asked = listed && upload.value;
  const without = typeof known === "string" ? h(Failed, { title: "The experiments could not be listed", message: known, again: load }) : [BONE, BONE];
  const isAsking = asked !== null;
  return html`
    <div class="welcome" hidden=${isAsking}>
      ${listed && h(TourOffer, { experiments: listed })}
      <section aria-label="Your own video">${h(DropZone, {})}</section>
      ${h(OwnFilterOffer, {})}
    </div>
    ${listed && asked && h(TargetForm, { key: asked.id, upload: asked, experiments: listed, leave })}
    <div data-part="browse" hidden=${isAsking}>
      <h2>Experiments</h2>
      ${h(Compiling, {})}
      <div class="families" data-part="experiments">
        ${listed ? h(Families, { experiments: listed, compilation: compilation.value }) : without}
      </div>
      <div role="status" data-part="plugins">
        ${problems.value.length > 0 && html`<ul class="problems">${problems.value.map((problem) => html`<li>${problem}</li>`)}</ul>`}
      </div>
    </div>
  `;
}

/** How far compiling is; it goes away by itself. */
function Compiling() {
  const now = compilation.value;
  const meter = now && h(Made, { key: `${now.done}`, make: () => compilationMeter(now) });
  const note = now?.finished === false && html`<p class="note compiling">${inSentenceCase(now.sentence)}. ${meter}</p>`;
  return html`<div role="status" data-part="compiling">${note}</div>`;
}

if (RUN.test(location.hash)) location.replace(`work?show=runs${location.hash}`);
addEventListener("hashchange", findUpload);
followCompiling((now) => (compilation.value = now)).catch(() => (compilation.value = null));
// A page that comes back from the browser's cache shows what was; ask again.
addEventListener("pageshow", (event) => event.persisted && load());
const links = [element("a", { class: "link", href: GLOSSARY }, "Glossary"), element("a", { class: "link", href: REFERENCES }, "References")];
showPage("start", "experiments", Start, links);
