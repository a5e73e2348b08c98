/** Fitting: parameters of the tracker are fitted to the first half of the run's data, and judged by the second half. The session continues
 meanwhile; the result opens as a branch. */

import { cancelJob, followJob, messageOf, Meter, request } from "../shared/api.js";
import { openDialog } from "../shared/dialog.js";
import { Boxes } from "../shared/dom.js";
import { number, parameterValue } from "../shared/format.js";
import { Doing } from "../shared/page.js";
import { Explained } from "../shared/terms.js";
import { h, html, useSignal } from "../vendor/preact.js";
import { steer } from "./steering.js";

/** @import { Fit, Half } from "../shared/messages.js" */
/** @import { Store } from "./store.js" */

const MOST = 4;

/** @typedef {{store: Store, end: AbortSignal, close: () => void}} Place The dialog's store, its end, which stops requests, and a way to
 * close it. */

/** Ask for the parameters to fit, and show the result.
 *
 * @param {Store} store
 */
export function fitDialog(store) {
  const wanted = new AbortController();
  const body = (/** @type {() => void} */ close) => h(Fitting, { store, end: wanted.signal, close });
  openDialog("Fit noise to data", body, "wide").addEventListener("close", () => wanted.abort());
}

/** @param {Place} place */
function Fitting({ store, end, close }) {
  const session = store.known;
  const offered = (session.fittable[session.tracker] ?? []).flatMap((name) => session.declarations.filter((each) => each.name === name));
  const chosen = useSignal(offered.slice(0, MOST).map(({ name }) => name));
  const problem = useSignal("");
  const share = useSignal(/** @type {number|null} */ (null));
  const found = useSignal(/** @type {Fit|null} */ (null));
  const begin = async (/** @type {Event} */ event) => {
    event.preventDefault();
    share.value = 0;
    try {
      const begun = await request("POST sessions/{session}/fits", { session: session.id, body: { numbers: chosen.value } });
      end.addEventListener("abort", () => cancelJob(begun.id));
      const job = await followJob(begun, (now) => now && now.total > 0 && (share.value = now.done / now.total), end);
      if (job === null) return;
      found.value = job.result;
      problem.value = job.error ?? "";
    } catch (error) {
      problem.value = messageOf(error);
    }
    share.value = null;
  };
  if (found.value !== null) return html`<div class="fit" aria-live="polite">${h(Result, { found: found.value, store, close })}</div>`;
  if (share.value !== null) {
    return html`<div class="fit" aria-live="polite">
      <p>Running the tracker on the same frames with other values. The session continues meanwhile.</p>
      ${h(Meter, { share: share.value, label: "Progress of the fit" })}
      <footer><button type="button" autofocus onClick=${close}>Cancel</button></footer>
    </div>`;
  }
  const options = offered.map((each) => {
    const now = valueOf(session.parameters[each.name], each);
    return { value: each.name, words: html`<span class="grow">${each.title}</span><span class="hint">${now}</span>`, hint: each.description };
  });
  const choose = (/** @type {string[]} */ some) => (chosen.value = some);
  return html`<div class="fit" aria-live="polite"><form method="dialog" onSubmit=${begin}>
    <p>
      Finds the values under which frames 1 to ${session.computed} are most probable. They are found on the first half, and kept only
      if the second half agrees.
    </p>
    ${problem.value !== "" && html`<p class="hint" role="alert">${problem.value}</p>`}
    <div class="fit-choices" role="group" aria-label=${`Numbers to fit, ${MOST} at most`}>
      ${h(Boxes, { options, chosen: chosen.value, choose, most: MOST })}
    </div>
    <footer>
      <button type="button" onClick=${close}>Cancel</button>
      <button type="submit" class="primary" disabled=${chosen.value.length === 0}>Fit</button>
    </footer>
  </form></div>`;
}

/** The result, before and after, and a button that opens it as a branch.
 *
 * @param {{found: Fit, store: Store, close: () => void}} props
 */
function Result({ found, store, close }) {
  const session = store.known;
  const open = async () => {
    const { position } = session; // that of the branch is another one
    const made = await steer(store, { kind: "branch", frame: 0, values: { ...found.values, tracker: found.tracker }, title: "Fitted values" });
    if (!made) return;
    close();
    await steer(store, { kind: "seek", frame: position });
  };
  const numbers = found.numbers.map((each) => {
    const note = each.at_bound && " (at its bound: the best may lie beyond)";
    return html`<tr><th scope="row">${each.title}</th><td>${valueOf(each.before, each)}</td><td>${valueOf(each.after, each)}${note}</td></tr>`;
  });
  const again = !found.kept && session.computed + 1 < session.frames ? "More frames may help: let the run continue, and fit again." : "";
  const about = `${found.procedure} Log evidence: log probability of each next frame by the filter, nats per frame; higher is better. ${again}`;
  return html`
    <p class="fit-verdict" role="status">${found.verdict}</p>
    ${found.caution && html`<p class="hint">${found.caution}</p>`}
    <div class="fit-table"><table>
      <thead><tr>${["", "Before", "After"].map((title) => html`<th scope="col">${title}</th>`)}</tr></thead>
      <tbody>${numbers}${found.halves.map((half, place) => h(HalfRows, { half, place }))}</tbody>
    </table></div>
    <p class="hint">${h(Explained, { text: about, experiment: session.recipe.experiment })}</p>
    <footer>
      <button type="button" onClick=${close}>${found.kept ? "Keep the present values" : "Close"}</button>
      ${found.kept && h(Doing, { label: "Open as a branch", class: "primary", autofocus: true, run: open })}
    </footer>
  `;
}

/** @param {{half: Half, place: number}} props */
function HalfRows({ half: { first, last, before, after }, place }) {
  const row = (/** @type {string} */ name, /** @type {(score: Half["before"]) => string} */ value) =>
    html`<tr><th scope="row">${name}</th><td>${value(before)}</td><td>${value(after)}</td></tr>`;
  const limits = (before.nis_limits ?? []).map((end) => number(end, 2)).join(" to ");
  return [
    html`<tr class="fit-half"><th scope="rowgroup" colspan="3">Frames ${first} to ${last}, ${place === 0 ? "used" : "not used"}</th></tr>`,
    row("Log evidence", (score) => number(score.log_evidence, 3).replace("-", "−")),
    ["50", "95"]
      .filter((promised) => promised in before.coverage)
      .map((promised) => row(`Truth in the ${promised} % band`, ({ coverage }) => `${number(100 * coverage[promised], 0)} %`)),
    before.nees !== null && row("NEES (1 is right)", ({ nees }) => number(Number(nees), 2)),
    before.nis !== null && row(`NIS (${limits} is right)`, ({ nis }) => number(Number(nis), 2)),
  ];
}

/**
 * @param {unknown} value
 * @param {{unit: string}} declaration
 */
function valueOf(value, declaration) {
  return parameterValue(Number(value), { unit: declaration.unit, kind: "number" });
}
