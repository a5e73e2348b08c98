/** The references page: the sources of each experiment, ready to cite. */

import { request } from "../shared/api.js";
import { Loaded, showPage } from "../shared/page.js";
import { Citations } from "../shared/terms.js";
import { h, html, useEffect } from "../vendor/preact.js";

/** @import { ExperimentPublic } from "../shared/messages.js" */

const BONE = html`<section aria-hidden="true"><div class="bone short shimmer"></div><div class="bone shimmer"></div></section>`;

/** @param {{experiments: ExperimentPublic[]}} props */
function References({ experiments }) {
  useEffect(() => document.querySelector(`[id="${CSS.escape(location.hash.slice(1))}"]`)?.scrollIntoView(), []);
  return experiments.map(({ id, title, references }) =>
    html`<section id=${id} aria-label=${title}><h2>${title}</h2>${h(Citations, { title, citations: references })}</section>`,
  );
}

const load = async () => h(References, { experiments: await request("GET experiments") });
showPage("references", null, () => h(Loaded, { load, failed: "Couldn't load the references", bones: [BONE, BONE, BONE] }));
