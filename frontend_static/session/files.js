/** The dialog of files: those that the run, or the frame that is shown, can be taken away as, and those that can be brought in. */

import { api } from "../shared/api.js";
import { openDialog } from "../shared/dialog.js";
import { elementOf } from "../shared/dom.js";
import { Exports } from "../shared/exports.js";
import { attempt, toast } from "../shared/toast.js";
import { h, html, useEffect, useSignal } from "../vendor/preact.js";
import { giveTruth, markTruth } from "./truth/marking.js";

/** @import { Declaration } from "../shared/messages.js" */
/** @import { Mounted } from "./mount.js" */

/** Bytes of a file that is not even sent: the server says what is wrong with smaller ones. */
const LARGEST = 500_000;

/** @param {Mounted} view */
export function filesDialog(view) {
  openDialog("Export and import", (close) => [elementOf(h(Files, { view, close }))], { wide: true });
}

/** @param {{view: Mounted, close: () => void}} props */
function Files({ view, close }) {
  const { id, exports, plots, declarations, parameters, upload, truth_columns: columns } = view.store.known;
  const begin = (/** @type {string} */ name, /** @type {string} */ plot) => api.exportSession(id, name, plot);
  const files = declarations.filter(({ kind }) => kind === "file");
  const takesTruth = upload !== null && columns.length > 0;
  const brought = html`<section>
    <h3>Bring in</h3>
    <ul class="menu-list">
      ${takesTruth && h(Truth, { view, upload, close })}
      ${files.map((declaration) => h(BringIn, { key: declaration.name, session: id, declaration, isUsed: parameters[declaration.name] !== "" }))}
    </ul>
  </section>`;
  return html`<div class="files">
    <section><h3>Take away</h3>${h(Exports, { offered: exports, plots, begin })}</section>
    ${(takesTruth || files.length > 0) && brought}
  </div>`;
}

/** @param {{session: string, declaration: Declaration, isUsed: boolean}} props `isUsed` says whether there is such a file already. */
function BringIn({ session, declaration: { name, title, description, accept }, isUsed }) {
  const use = async (/** @type {string} */ text, /** @type {string} */ words) => {
    await api.command(session, { kind: "change", values: { [name]: text } });
    const run = () => attempt(() => api.command(session, { kind: "restart" }));
    toast(`${words} from the next frame on`, { action: { label: "Begin again", run } });
  };
  const send = async (/** @type {Event & {currentTarget: HTMLInputElement}} */ { currentTarget: input }) => {
    const file = input.files?.[0];
    if (!file) return;
    const text = await file.text();
    input.value = "";
    if (file.size > LARGEST) toast(`${file.name} is too large for this kind of file`, { kind: "error" });
    // An empty text as a value would mean that there is no file.
    else if (text.trim() === "") toast(`${file.name} is empty`, { kind: "error" });
    else await attempt(() => use(text, `${file.name} is used`));
  };
  const drop = () => attempt(() => use("", "The file is no longer used"));
  return html`<li>
    <label class="button quiet grow" title=${description}>
      ${title}…${isUsed && html`<span class="hint">in use</span>`}
      <input type="file" accept=${accept} class="visually-hidden" aria-label=${title} data-file=${name} onChange=${send} />
    </label>
    ${isUsed && html`<button type="button" class="quiet" title=${`Stop using this file: ${title}`} data-drop=${name} onClick=${drop}>Remove</button>`}
  </li>`;
}

/**
 * Truth of a recording: bringing it in, marking it in the pictures, and taking away what is known.
 *
 * @param {{view: Mounted, upload: string, close: () => void}} props
 */
function Truth({ view, upload, close }) {
  const { id, recipe, truth_columns: columns, truth_mark: mark } = view.store.known;
  const isKnown = useSignal(false);
  const look = async () => {
    isKnown.value = (await api.truth(upload, recipe.experiment).catch(() => null)) !== null;
  };
  useEffect(() => void look(), []);
  const send = async (/** @type {Event & {currentTarget: HTMLInputElement}} */ { currentTarget: input }) => {
    const files = [...(input.files ?? [])];
    input.value = "";
    if (files.length > 0 && (await giveTruth(id, files))) await look();
  };
  const start = () => {
    close();
    markTruth(view);
  };
  const address = api.truthAddress(upload, recipe.experiment);
  const known = html`<a class="button quiet" download title="The truth that is known, CSV" data-role="known-truth" href=${address}>Download</a>`;
  const words = `A table, CSV, with the columns ${columns.join(", ")}; frames count from 0 in the recording`;
  return html`<li>
    <label class="button quiet grow" title=${words}>
      Truth, CSV…
      <input type="file" accept=".csv,.txt,.xml,.json,text/csv" class="visually-hidden" aria-label="Truth" data-file="truth" onChange=${send} />
    </label>
    ${mark && html`<button type="button" class="quiet" title="Mark the target in the pictures (T)" data-role="mark-truth" onClick=${start}>Mark…</button>`}
    ${isKnown.value && known}
  </li>`;
}
