/** The exports of a run: buttons by kind, and below them the files that the server is writing. A finished file is fetched, unless it was
 stopped. */

import { h, html, useEffect, useMemo, useSignal } from "../vendor/preact.js";
import { absolute, cancelJob, followJob, messageOf, Meter } from "./api.js";
import { openDialog } from "./dialog.js";
import { attempt, build, CopyButton, Icon, Select, toast } from "./dom.js";
import { Loaded } from "./page.js";

/** @import { ExportJob, FileKind, SourceCode } from "./messages.js" */

// A link, Python code or a command that computes the same again, ready to copy.

/** Show a link and source code, ready to copy.
 *
 * @param {string} title
 * @param {string[]} words Sentences to show; empty ones are left out.
 * @param {() => Promise<SourceCode>} ask
 * @param {string} [link] Link relative to the server's address.
 */
export function openCode(title, words, ask, link) {
  const address = link === undefined ? "" : absolute(link);
  const select = (/** @type {Event & {currentTarget: HTMLInputElement}} */ { currentTarget }) => currentTarget.select();
  openDialog(title, (close) => html`
    ${words.map((each) => each && html`<p>${each}</p>`)}
    ${address && html`<input type="text" readonly value=${address} aria-label="Link" data-role="share-link" autofocus onFocus=${select} />`}
    <div class="source-code">${h(Loaded, { load: () => codeLines(ask), failed: "Couldn't write the code" })}</div>
    <footer><button type="button" onClick=${close}>Close</button>${address && h(CopyButton, { label: "Copy link", text: address, what: "the link" })}</footer>
  `, "wide");
}

/** @param {{ask: () => Promise<SourceCode>}} props */
export function CodeButton({ ask }) {
  const open = () => openCode("The same in code", ["These lines compute the same numbers where pftrack is installed."], ask);
  const title = "Copy as Python or as a command";
  return html`<button type="button" class="tool" title=${title} aria-label=${title} data-role="code" onClick=${open}>${h(Icon, { name: "code" })}</button>`;
}

/** @param {() => Promise<SourceCode>} ask */
async function codeLines(ask) {
  const { python, command } = await ask();
  return [["Python", python], ["command", command]].map(([what, text]) => html`<details open=${text.length < 400}>
    <summary>As ${what}${h(CopyButton, { label: `Copy as ${what}`, text, what: "the lines" })}</summary>
    <pre tabindex="0" aria-label=${`Lines of ${what}`}>${text}</pre>
  </details>`);
}

/** @typedef {{id: string, title: string}} Plot */

/** @typedef {(name: string, plot?: string) => Promise<ExportJob>} Begin Has the server write a file; of all plots if none is named. */

/** @type {[FileKind["group"], string][]} In the order of the list. */
const GROUPS = [
  ["numbers", "Numbers of all frames"],
  ["boxes", "Estimated boxes"],
  ["truth", "True boxes"],
  ["film", "Moving pictures"],
  ["plots", "Plots"],
  ["documents", "The run and its sources"],
  ["model", "This frame"],
];

/** @param {{offered: readonly FileKind[], plots?: readonly Plot[], begin: Begin}} props */
export function Exports({ offered, plots = [], begin }) {
  const plot = useSignal("");
  const writing = useSignal(/** @type {readonly ExportJob[]} */ ([]));
  const write = (/** @type {string} */ name, /** @type {string|undefined} */ of) => attempt(async () => {
    const begun = await begin(name, of);
    writing.value = [...writing.value, begun];
  });
  const options = [{ id: "", title: "All plots" }, ...plots].map(({ id, title }) => ({ value: id, words: title }));
  const groups = GROUPS.map(([group, title]) => {
    const some = offered.filter((one) => one.group === group);
    const isChosen = group === "plots" && plots.length > 0;
    const of = () => (isChosen && plot.value) || undefined;
    const buttons = some.map(({ name, title: long, short }) =>
      html`<button type="button" title=${long} data-export=${name} onClick=${() => write(name, of())}>${short || long}</button>`);
    return some.length > 0 && html`<div class="export-group" role="group" aria-label=${title}>
      <h3>${title}</h3>
      <div class="export-row">
        ${isChosen && h(Select, { label: "Which plot", options, value: plot.value, choose: (id) => (plot.value = id) })}${buttons}
      </div>
    </div>`;
  });
  const jobs = writing.value.map((begun) =>
    h(Writing, { key: begun.id, begun, end: () => (writing.value = writing.value.filter(({ id }) => id !== begun.id)) }));
  return html`<div class="exports"><div>${groups}</div><ul class="export-jobs" aria-label="Being written">${jobs}</ul></div>`;
}

/** @param {{begun: ExportJob, end: () => void}} props The progress of a file. It is fetched when it is complete, even if its list is closed
 * by then. */
function Writing({ begun, end }) {
  const { id, name } = begun;
  const share = useSignal(/** @type {number|null} */ (null));
  const wanted = useMemo(() => new AbortController(), []);
  useEffect(() => void fetchFile(begun, (now) => (share.value = now), wanted.signal).finally(end), []);
  const stop = () => {
    wanted.abort();
    cancelJob(id);
    end();
  };
  return html`<li data-writing=${id}>
    <span class="grow">${name}</span>${h(Meter, { share: share.value, label: `Progress of ${name}` })}
    <button type="button" class="quiet" onClick=${stop}>Stop</button>
  </li>`;
}

/** Fetch a file once it is written.
 *
 * @param {ExportJob} begun
 * @param {(share: number) => void} tell
 * @param {AbortSignal} signal Ends the waiting.
 */
async function fetchFile(begun, tell, signal) {
  try {
    const job = await followJob(begun, (now) => now && now.total > 0 && tell(now.done / now.total), signal);
    if (job === null) return;
    if (job.result === null) throw new Error(job.error ?? `${job.name} could not be written`);
    build("a", { href: job.result.address, download: job.name }).click();
  } catch (error) {
    toast(messageOf(error), { kind: "error" });
  }
}
