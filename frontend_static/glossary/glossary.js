/** The glossary page: meanings of the words on all pages. */

import { request } from "../shared/api.js";
import { Loaded, showPage } from "../shared/page.js";
import { h, html } from "../vendor/preact.js";

/** @import { Section } from "../shared/messages.js" */

/** @param {Section} section */
function meanings({ title, terms }) {
  const listed = terms.map(({ name, meaning }) => html`<dt>${name}</dt><dd>${meaning}</dd>`);
  return terms.length > 0 && html`<section aria-label=${title}><h2>${title}</h2><dl>${listed}</dl></section>`;
}

showPage("glossary", "help", () => h(Loaded, { load: async () => (await request("GET glossary")).map(meanings), failed: "Couldn't load the glossary" }));
