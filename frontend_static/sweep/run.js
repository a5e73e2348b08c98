/** Opens a run of a sweep as a session. It is a page of its own, so that a plain link can open it in a tab. */

import { request } from "../shared/api.js";
import { lastOfAddress } from "../shared/dom.js";
import { Loaded, showPage } from "../shared/page.js";
import { h, html } from "../vendor/preact.js";

const [sweep, run] = [lastOfAddress(2), lastOfAddress()];
const tracker = new URLSearchParams(location.search).get("tracker");
const bones = html`<div class="notice" role="status">
  <h2>Opening run ${run}</h2>
  <p>It is computed up to ten frames before the target is lost.</p>
  <div class="bone shimmer"></div>
</div>`;

async function open() {
  const session = await request("POST sweeps/{sweep}/rows/{run}/open", { sweep, run: Number(run), body: { tracker: tracker || null } });
  location.replace(session.page);
  return bones;
}

showPage("wait", null, () => [
  h(Loaded, { load: open, failed: "Couldn't open this run", bones }),
  html`<a href=${`sweep/${encodeURIComponent(sweep)}`}>Back to the sweep</a>`,
]);
