/** Dialogs of a session: export and import, the link of a run, the keys, information on an experiment, and branches. */

import { addressOf, request } from "../shared/api.js";
import { openDialog, openKeys } from "../shared/dialog.js";
import { FileButton, toast } from "../shared/dom.js";
import { Exports, openCode } from "../shared/exports.js";
import { tourLink } from "../shared/page.js";
import { linkTo } from "../shared/share_link.js";
import { Citations, GLOSSARY, REFERENCES } from "../shared/terms.js";
import { isParticipant } from "../shared/visitor.js";
import { h, html, useEffect, useSignal } from "../vendor/preact.js";
import { giveTruth, markTruth } from "./marking.js";
import { DeclaredControl } from "./panel.js";
import { HELP } from "./keys.js";
import { steer } from "./steering.js";

/** @import { Declaration, SessionPublic } from "../shared/messages.js" */
/** @import { Child } from "../vendor/preact.js" */
/** @import { Mounted } from "./mount.js" */
/** @import { Values } from "./steering.js" */

/** CSS classes of a button in a list. */
const IN_A_LIST = "quiet grow";

// Links to a whole run: experiment, seed, tracker and timeline are in the fragment, which no server logs. Everyone who opens one gets the
// same numbers.

/**
 * Show the link of a session, ready to be copied.
 *
 * @param {SessionPublic} session
 */
export function shareDialog({ id, branch, recipe, computed, position, upload }) {
  const words = [
    `The link holds the experiment, seed, tracker, all changes of parameters, and frame ${position}. ` +
      "It gives the same numbers to everyone who can reach this server.",
    upload ? "The video itself stays on this server." : "",
  ];
  const body = { runs: [{ reference: `${id}:${branch}` }], frames: computed + 1 };
  openCode("Share this run", words, () => request("POST source-code", { body }), linkTo({ recipe, upload, position }));
}

// Dialogs that explain: the list of keys, and an experiment's description and sources.

export function helpDialog() {
  openKeys(HELP.map(({ keys, what }) => [keys, what]), !isParticipant && h(FurtherHelp, {}));
}

function FurtherHelp() {
  const tour = useSignal(/** @type {string|null} */ (null));
  // Without the tour the requested keys are still shown.
  useEffect(() => void request("GET experiments").then((all) => (tour.value = tourLink(all)), () => {}), []);
  return html`
    <p>${tour.value && html`<a href=${tour.value} data-role="tour">Take the guided tour</a>`}</p>
    <p><a href=${GLOSSARY}>Glossary</a></p>
  `;
}

/** @param {import("../shared/messages.js").ExperimentPublic} experiment */
export function aboutDialog({ id, title, question, description, references }) {
  openDialog(title, () => html`
    <p class="question">${question}</p>
    <p>${description}</p>
    ${h(Citations, { title, citations: references })}
    ${!isParticipant && html`<p><a href=${`${REFERENCES}#${encodeURIComponent(id)}`}>All references</a> · <a href=${GLOSSARY}>Glossary</a></p>`}
  `, "wide");
}

// The dialog that makes a branch: its first frame, tracker and parameters.

/** @param {Mounted} view */
export function branchDialog({ store, steering }) {
  const session = store.known;
  steering.pause();
  // After the last frame of a run there is nothing more to compute.
  const last = Math.min(session.computed, session.frames - 2);
  if (last < 0) return;
  const other = session.trackers.find((tracker) => tracker.id !== session.tracker) ?? session.trackers[0];
  openDialog("Branch", (close) => h(Branch, { store, last, first: other.id, close }));
}

/** @param {{store: Mounted["store"], last: number, first: string, close: () => void}} props `first` is a tracker. */
function Branch({ store, last, first, close }) {
  const session = store.known;
  const changed = useSignal(/** @type {Values} */ ({}));
  const isSending = useSignal(false);
  const submit = async (/** @type {Event & {currentTarget: HTMLFormElement}} */ event) => {
    event.preventDefault();
    const { frame, tracker, title } = /** @type {Record<string, string>} */ (Object.fromEntries(new FormData(event.currentTarget)));
    isSending.value = true;
    const values = { ...changed.value, tracker };
    const made = await steer(store, { kind: "branch", frame: Number(frame), values, ...(title.trim() && { title: title.trim() }) });
    isSending.value = false;
    if (made) close();
  };
  // Enter on a focused, closed list submits the form, as in a field.
  const press = (/** @type {KeyboardEvent & {currentTarget: HTMLSelectElement}} */ event) => {
    const list = event.currentTarget;
    if (event.key !== "Enter" || (CSS.supports("selector(:open)") && list.matches(":open"))) return;
    event.preventDefault();
    list.form?.requestSubmit();
  };
  const turned = session.declarations.filter(({ name, live, kind }) => name in session.parameters && live && kind !== "file");
  const controls = (/** @type {boolean} */ isFirst) =>
    turned
      .filter(({ name }) => session.about.includes(name) === isFirst)
      .map((declaration) => {
        const { name } = declaration;
        const propose = (/** @type {Values[string]} */ value) => (changed.value = { ...changed.value, [name]: value });
        return h(DeclaredControl, { key: name, declaration, value: changed.value[name] ?? session.parameters[name], propose });
      });
  const [about, rest] = [controls(true), controls(false)];
  const trackers = session.trackers.map(({ id, title }) => {
    return html`<option value=${id} selected=${id === first}>${id === session.tracker ? `${title} (as now)` : title}</option>`;
  });
  return html`<form method="dialog" onSubmit=${submit}>
    <p>The branch shares all frames up to this one. From the next frame on it is computed separately, with the same random numbers.</p>
    <label for="branch-frame">From frame (0 to ${last})</label>
    <input id="branch-frame" name="frame" type="number" min="0" max=${last} step="1" required defaultValue=${Math.min(session.position, last)} />
    <label for="branch-tracker">Tracker</label>
    <select id="branch-tracker" name="tracker" autofocus onKeyDown=${press}>${trackers}</select>
    <div class="branch-parameters" role="group" aria-label="Parameters from the next frame on">
      ${about}
      ${rest.length > 0 && html`<details><summary>${about.length > 0 ? "More" : "Parameters"}</summary>${rest}</details>`}
    </div>
    <label for="branch-title">Name (optional)</label>
    <input id="branch-title" name="title" type="text" maxlength="60" placeholder="default: tracker and frame" />
    <footer>
      <button type="button" onClick=${close}>Cancel</button>
      <button type="submit" class="primary" disabled=${isSending.value}>Branch here</button>
    </footer>
  </form>`;
}

/** @param {Mounted} view */
export function filesDialog(view) {
  openDialog("Export and import", (close) => h(Files, { view, close }), "wide");
}

/** @param {{view: Mounted, close: () => void}} props */
function Files({ view, close }) {
  const { id, exports, plots, declarations, parameters, upload, truth_columns: columns } = view.store.known;
  const begin = (/** @type {string} */ name, /** @type {string|undefined} */ plot) =>
    request("POST sessions/{session}/exports/{export}", { session: id, export: name, plot });
  const files = declarations.filter(({ kind }) => kind === "file");
  const takesTruth = upload !== null && columns.length > 0;
  const brought = html`<section>
    <h3>Import</h3>
    <ul class="menu-list">
      ${takesTruth && h(Truth, { view, upload, close })}
      ${files.map((declaration) => h(BringIn, { key: declaration.name, store: view.store, declaration, isUsed: parameters[declaration.name] !== "" }))}
    </ul>
  </section>`;
  return html`<div class="files">
    <section><h3>Export</h3>${h(Exports, { offered: exports, plots, begin })}</section>
    ${(takesTruth || files.length > 0) && brought}
  </div>`;
}

/** @param {{store: Mounted["store"], declaration: Declaration, isUsed: boolean}} props `isUsed` if such a file is in use. */
function BringIn({ store, declaration: { name, title, description, accept }, isUsed }) {
  const use = async (/** @type {string} */ text, /** @type {string} */ words) => {
    const taken = await steer(store, { kind: "change", values: { [name]: text } });
    const run = () => steer(store, { kind: "restart" });
    if (taken) toast(`${words} from the next frame on`, { action: { label: "Restart", run } });
  };
  const take = async (/** @type {File[]} */ [file]) => {
    const text = await file.text();
    // An empty text would remove the file.
    if (text.trim() === "") toast(`${file.name} is empty`, { kind: "error" });
    else await use(text, `${file.name} is used`);
  };
  const drop = () => use("", "The file is no longer used");
  const words = html`${title}…${isUsed && html`<span class="hint">in use</span>`}`;
  return html`<li>
    ${h(FileButton, { name, label: title, words, title: description, accept, take, look: IN_A_LIST })}
    ${isUsed && html`<button type="button" class="quiet" title=${`Stop using this file: ${title}`} data-drop=${name} onClick=${drop}>Remove</button>`}
  </li>`;
}

/** Truth of a recording: import, marking in the pictures, and download.
 *
 * @param {{view: Mounted, upload: string, close: () => void}} props
 */
function Truth({ view, upload, close }) {
  const { id, recipe, truth_columns: columns, truth_mark: mark } = view.store.known;
  const about = { upload, experiment: recipe.experiment };
  const isKnown = useSignal(false);
  const look = async () => {
    isKnown.value = (await request("GET uploads/{upload}/truth", about).catch(() => null)) !== null;
  };
  useEffect(() => void look(), []);
  const take = async (/** @type {File[]} */ files) => {
    if (await giveTruth(id, files)) await look();
  };
  const start = () => {
    close();
    markTruth(view);
  };
  const address = addressOf("GET uploads/{upload}/truth.csv", about);
  const known = html`<a class="button quiet" download title="The known truth, CSV" data-role="known-truth" href=${address}>Download</a>`;
  const words = `A table, CSV, with the columns ${columns.join(", ")}; frames count from 0 in the recording`;
  return html`<li>
    ${h(FileButton, { name: "truth", label: "Truth", words: "Truth, CSV…", title: words, accept: ".csv,.txt,.xml,.json,text/csv", take, look: IN_A_LIST })}
    ${mark && html`<button type="button" class="quiet" title="Mark the target in the pictures (T)" data-role="mark-truth" onClick=${start}>Mark…</button>`}
    ${isKnown.value && known}
  </li>`;
}
