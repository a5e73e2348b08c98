/** The drop zone: takes videos, pictures, tables of tracks, results of trackers and saved runs, and shows the progress. */

import { cancelJob, followJob, here, jobOf, messageOf, Meter, progressWords, request, send, statusOf } from "../shared/api.js";
import { attempt, Icon, toast } from "../shared/dom.js";
import { bytes } from "../shared/format.js";
import { after } from "../shared/timing.js";
import { h, html, signal, useEffect, useRef, useSignal } from "../vendor/preact.js";
import { recordClip } from "./camera.js";

/** @import { Asked, Transfer } from "../shared/api.js" */
/** @import { ColumnMeaning, ImportJob, Preview, Requests } from "../shared/messages.js" */

/** @typedef {{name: string, words: string, share: number|null, stop: () => void}} Work What is on its way; its share is null while nobody knows it. */
/** @typedef {{name: string, message: string}} Refusal */
/** @typedef {{files: File[], file: File, table: Preview, refusal: string}} Question What the columns of a table are that was not understood. */

const SILENT = "The server does not answer; trying again";
const ACCEPTED = "video/*,image/*,.csv,.tsv,.txt,.xml,.json,text/csv,.pft";
const OFFERED =
  "A video, an animation (GIF, PNG, WebP) or pictures, a table of tracks (.csv), results of any tracker, alone or with their clip and truth, " +
  "a recording or a saved run (.pft)";
const TABLE = /\.(csv|tsv|txt)$/i;
const PLACE_MS = 1000;
/** Bytes of a table from which its columns are read. */
const HEAD_BYTES = 16_384;
/** The status of a transfer stopped by a person. */
const STOPPED = -1;
/** The run being computed, named in the address, so that a reload still shows it. */
const IMPORT = /^#import\/(\w+)$/;

/** Content of the zone; null while it waits for files. */
const shown = signal(/** @type {Work|Refusal|Question|null} */ (null));

/** The zone where files are chosen, or dropped anywhere in the page. */
export function DropZone() {
  const isOver = useSignal(false);
  useEffect(() => {
    const end = new AbortController();
    const on = (/** @type {"dragover"|"dragleave"|"drop"} */ type, /** @type {(event: DragEvent) => void} */ act) =>
      document.addEventListener(type, (event) => event.dataTransfer?.types.includes("Files") && act(event), { signal: end.signal });
    on("dragover", (event) => {
      event.preventDefault();
      isOver.value = true;
    });
    // Within the page the drag only moves from one element to another.
    on("dragleave", ({ relatedTarget }) => (isOver.value = relatedTarget !== null));
    on("drop", (event) => {
      event.preventDefault();
      isOver.value = false;
      take([...(event.dataTransfer?.files ?? [])]);
    });
    resume();
    return () => end.abort();
  }, []);
  return html`<div class=${isOver.value ? "drop over" : "drop"}>${content(shown.value)}</div>`;
}

/** @param {Work|Refusal|Question|null} now */
function content(now) {
  if (now === null) return h(Invitation, {});
  if ("table" in now) return h(Columns, now);
  const { name } = now;
  if ("share" in now) {
    return html`
      <p class="drop-words">${name}</p>
      ${h(Meter, { share: now.share, label: name })}
      <p class="hint" role="status">${now.words}</p>
      <button type="button" onClick=${now.stop}>Stop</button>
    `;
  }
  return html`
    <p class="drop-words"><strong>${name} was not accepted</strong></p>
    <p class="wrong" role="alert">${now.message}</p>
    <button type="button" onClick=${invite}>Choose another file</button>
  `;
}

function Invitation() {
  const choose = (/** @type {Event & {currentTarget: HTMLInputElement}} */ { currentTarget: { files } }) => take([...(files ?? [])]);
  return html`
    <input type="file" multiple class="visually-hidden" id="file-picker" accept=${ACCEPTED} onChange=${choose} />
    ${h(Icon, { name: "film" })}
    <p class="drop-words"><strong>Drop a video here</strong> or <label for="file-picker" class="link">choose a file</label></p>
    <p class="hint">${OFFERED}</p>
    <button type="button" data-role="camera" onClick=${() => recordClip((clip) => take([clip]))}>${h(Icon, { name: "camera" })}Use the camera</button>
  `;
}

/** @param {Question} props The form for a table's columns, below its first lines. */
function Columns({ files, file, table, refusal }) {
  const form = useRef(/** @type {HTMLFormElement|null} */ (null));
  useEffect(() => form.current?.querySelector("select")?.focus(), []);
  const submit = (/** @type {Event & {currentTarget: HTMLFormElement}} */ event) => {
    event.preventDefault();
    const said = [...new FormData(event.currentTarget)].filter(([, place]) => place !== "");
    sendUpload(files, Object.fromEntries(said.map(([meaning, place]) => [meaning, Number(place)])));
  };
  const choice = (/** @type {ColumnMeaning} */ { name, title }) => html`<label>
    ${title}
    <select id=${`column-${name}`} name=${name}>
      <option value="">none</option>
      ${table.header.map((words, place) => html`<option value=${place} selected=${place === table.guess[name]}>${words || `column ${place + 1}`}</option>`)}
    </select>
  </label>`;
  return html`<form ref=${form} class="columns" aria-label="Columns of the table" onSubmit=${submit}>
    <p class="drop-words"><strong>What are the columns of ${file.name}?</strong></p>
    <p class="hint">Choose the columns of the frame number and of the box: two edges or the centre, and the size or the other two edges.</p>
    <details><summary>Why is this needed?</summary><p class="hint">${refusal}</p></details>
    <div class="columns-rows" tabindex="0" role="region" aria-label="First lines">
      <table>
        <thead><tr>${table.header.map((title) => html`<th scope="col">${title}</th>`)}</tr></thead>
        <tbody>${table.rows.map((row) => html`<tr>${row.map((cell) => html`<td>${cell}</td>`)}</tr>`)}</tbody>
      </table>
    </div>
    <div class="columns-choices">${table.meanings.map(choice)}</div>
    <footer><button type="button" onClick=${invite}>Cancel</button><button type="submit" class="primary">Open it</button></footer>
  </form>`;
}

function invite() {
  shown.value = null;
}

/** @param {File[]} files */
async function take(files) {
  if (files.length === 0) return;
  if (shown.value !== null && "share" in shown.value) {
    toast("Other files are still uploading; wait for them, or stop them first");
    return;
  }
  const isRun = files.length === 1 && files[0].name.toLowerCase().endsWith(".pft") && !(await isRecording(files[0]));
  if (isRun) await transmit("POST runs/import", {}, files, "Computing the run", follow);
  else await sendUpload(files);
}

/**
 * @param {File[]} files
 * @param {Record<string, number>} [columns] Column numbers of a table by meaning.
 */
function sendUpload(files, columns) {
  return transmit("POST uploads", { columns: columns && JSON.stringify(columns) }, files, "Checking every frame", ({ id }) => {
    location.hash = `upload/${encodeURIComponent(id)}`;
  });
}

/** Send files, show the progress, and pass on the server's answer.
 *
 * @template {"POST uploads"|"POST runs/import"} R
 * @param {R} route
 * @param {Asked<R>} asked
 * @param {File[]} files
 * @param {string} reading Text for the server's work after the transfer.
 * @param {(answer: Requests[R]["answer"]) => void} received
 */
async function transmit(route, asked, files, reading, received) {
  const name = files.length === 1 ? files[0].name : `${files.length} files`;
  const size = files.reduce((sum, file) => sum + file.size, 0);
  const ended = new AbortController();
  let isSent = false;
  const tell = (/** @type {string} */ words, /** @type {number|null} */ share) => (shown.value = { name, words, share, stop: transfer.stop });
  const transfer = send(route, asked, files, (sent, total) => {
    if (isSent) return;
    isSent = sent >= total;
    if (!isSent) {
      tell(`${bytes(Math.min(sent, size))} of ${bytes(size)}`, sent / total);
      return;
    }
    tell(reading, null);
    tellPlace(transfer, (before) => tell(before > 0 ? `Waiting, ${before} before this one` : reading, null), ended.signal);
  });
  tell("", 0);
  try {
    const answer = await transfer.done;
    ended.abort();
    invite();
    received(answer);
  } catch (error) {
    ended.abort();
    const message = messageOf(error);
    shown.value = statusOf(error) === STOPPED ? null : ((await questionOf(files, message)) ?? { name, message });
  }
}

/** Report the place of a transfer in the server's queue until it ends.
 *
 * @param {Transfer<unknown>} transfer
 * @param {(before: number) => void} tell
 * @param {AbortSignal} ended
 */
async function tellPlace(transfer, tell, ended) {
  for (;;) {
    await after(PLACE_MS, ended);
    // The transfer itself will report the error.
    const before = await transfer.before().catch(() => null);
    if (before !== null && !ended.aborted) tell(before);
  }
}

/** The question about a table with unknown columns; null if there is not one such table.
 *
 * @param {File[]} files
 * @param {string} refusal
 * @returns {Promise<Question|null>}
 */
async function questionOf(files, refusal) {
  const [file, ...others] = files.filter(({ name }) => TABLE.test(name));
  if (!file || others.length > 0) return null;
  const table = await request("POST uploads/table", { body: { text: await file.slice(0, HEAD_BYTES).text() } }).catch(() => null);
  return table && { files, file, table, refusal };
}

/** Show the progress of a run that is computed before it is stored, and announce it when it is done.
 *
 * @param {ImportJob} begun
 */
async function follow(begun) {
  const { id, name } = begun;
  const wanted = new AbortController();
  const since = performance.now();
  const leave = () => {
    invite();
    leaveAddress();
  };
  const stop = () => {
    wanted.abort();
    cancelJob(id);
    leave();
  };
  let known = begun;
  const tell = (/** @type {ImportJob|null} */ now) => {
    known = now ?? known;
    const { done, total } = known;
    const words = total > 0 ? progressWords(done, total, (performance.now() - since) / 1000, done - begun.done) : "Waiting in the queue";
    shown.value = { name, words: now === null ? SILENT : words, share: total > 0 ? done / total : null, stop };
  };
  history.replaceState(null, "", here(`import/${id}`));
  tell(begun);
  try {
    const job = await followJob(begun, tell, wanted.signal);
    if (job === null) return;
    const { result: run, error } = job;
    if (run === null) throw new Error(error ?? "The run could not be imported");
    leave();
    toast(`${run.title} is in My work, under saved runs`);
    const session = await attempt(() => request("POST runs/{run}/open", { run: run.id }));
    if (session) location.assign(session.page);
  } catch (error) {
    if (wanted.signal.aborted) return;
    leaveAddress();
    shown.value = { name, message: messageOf(error) };
  }
}

/** Show a run again if it was being computed when the page was left. */
async function resume() {
  const id = IMPORT.exec(location.hash)?.[1];
  if (id === undefined) return;
  leaveAddress();
  // It may have been dropped meanwhile, or the server was restarted.
  const job = /** @type {ImportJob|null} */ (await jobOf(id).catch(() => null));
  // A finished run is among the saved runs.
  if (job !== null && job.state !== "done" && shown.value === null) await follow(job);
}

/** Remove the run from the address; an upload may be there by now. */
function leaveAddress() {
  if (IMPORT.test(location.hash)) history.replaceState(null, "", location.pathname);
}

/** Distinguish a recording of beliefs from a saved run: both are archives; the name of the first entry is after 30 bytes.
 *
 * @param {File} file
 */
async function isRecording(file) {
  return (await file.slice(30, 44).text()) === "recording.json";
}
