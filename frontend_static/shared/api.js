/**
 * The server's REST interface. Every failure is an `ApiError` whose message can be shown as it stands; a page never has
 * to make up words for it.
 */

import { html } from "../vendor/preact.js";
import { duration } from "./format.js";
import { after } from "./timing.js";

/** @import * as Messages from "./messages.js" */
/** @import { Job } from "./messages.js" */

// Addresses. The server may lie below any path, and a class below its link: the `<base>` of each page says where, and
// all addresses in pages and scripts are relative to that, as in `session/1f`. So a bare `#there` would lead to another page.

/** The start page, or that of the class for a participant. */
export const START = "./";

/**
 * An address as it can be opened elsewhere.
 *
 * @param {string} address Relative to that of the server.
 */
export function absolute(address) {
  return new URL(address, document.baseURI).href;
}

/**
 * A place on this page.
 *
 * @param {string} fragment
 */
export function here(fragment) {
  return `${location.pathname}${location.search}#${fragment}`;
}

/** @typedef {Record<string, string|number|boolean>} Query */
/** @typedef {(sent: number, total: number) => void} OnProgress In bytes, the form around the files included. */
/**
 * @template Answer
 * @typedef {object} Transfer
 * @property {Promise<Answer>} done
 * @property {() => Promise<number>} before How many the server works on before this one, once it has all of it.
 * @property {() => void} stop
 */

/** Where the interface is. */
export const ROOT = "api/v1/";

export class ApiError extends Error {
  /**
   * @param {number} status HTTP status; 0 when no answer came.
   * @param {{message: string, field?: string, bound?: string, value?: unknown}} error
   */
  constructor(status, error) {
    super(error.message);
    this.name = "ApiError";
    this.status = status;
    this.field = error.field;
    this.bound = error.bound;
    this.value = error.value;
  }
}

/**
 * The message of anything that was thrown.
 *
 * @param {unknown} error
 */
export function messageOf(error) {
  return error instanceof Error ? error.message : String(error);
}

/**
 * The status by which the server refused, or undefined if it was something else that went wrong.
 *
 * @param {unknown} error
 */
export function statusOf(error) {
  return error instanceof ApiError ? error.status : undefined;
}

/**
 * Ask the server for something and return the JSON of its answer (null for an empty one).
 *
 * @template Answer
 * @param {string} method
 * @param {string} path
 * @param {unknown} [body] A file is sent as it is, all else as JSON.
 * @param {AbortSignal} [signal] Ends it before the answer has come.
 * @returns {Promise<Answer>}
 */
export async function request(method, path, body, signal) {
  const isFile = body instanceof Blob;
  const headers = { accept: "application/json", ...(body !== undefined && !isFile && { "content-type": "application/json" }) };
  const options = { method, headers, ...(signal && { signal }), ...(body !== undefined && { body: isFile ? body : JSON.stringify(body) }) };
  let status;
  let text;
  try {
    const response = await fetch(ROOT + path, options);
    [status, text] = [response.status, await response.text()];
  } catch {
    throw new ApiError(0, { message: "The server does not answer" });
  }
  return read(status, text);
}

/**
 * Fetch a file, with the name that the server gives it.
 *
 * @param {string} path
 * @returns {Promise<{name: string, content: Blob}>}
 */
async function fetched(path) {
  const response = await fetch(ROOT + path).catch(() => {
    throw new ApiError(0, { message: "The server does not answer" });
  });
  if (!response.ok) read(response.status, await response.text());
  const [, name] = /filename="([^"]+)"/.exec(response.headers.get("content-disposition") ?? "") ?? ["", "file"];
  return { name, content: await response.blob() };
}

/**
 * Send files with progress, which `fetch` cannot report.
 *
 * @template Answer
 * @param {string} path
 * @param {Iterable<File>} files
 * @param {OnProgress} onProgress
 * @param {string} [method]
 * @returns {Transfer<Answer>}
 */
function send(path, files, onProgress, method = "POST") {
  const ticket = `${Date.now()}-${Math.random().toString(36).slice(2)}`;
  const form = new FormData();
  for (const file of files) form.append("file", file, file.name);
  const transfer = new XMLHttpRequest();
  /** @type {Promise<Answer>} */
  const done = new Promise((resolve, reject) => {
    transfer.upload.addEventListener("progress", (event) => onProgress(event.loaded, event.total));
    transfer.addEventListener("load", () => {
      try {
        resolve(read(transfer.status, transfer.responseText));
      } catch (error) {
        reject(error);
      }
    });
    transfer.addEventListener("error", () => reject(new ApiError(0, { message: "The connection broke during the upload" })));
    transfer.addEventListener("abort", () => reject(new ApiError(-1, { message: "The upload was stopped" })));
    transfer.open(method, `${ROOT}${path}${path.includes("?") ? "&" : "?"}ticket=${ticket}`);
    transfer.setRequestHeader("accept", "application/json");
    transfer.send(form);
  });
  const before = async () => {
    /** @type {Messages.QueuePublic} */
    const place = await request("GET", `queue/${ticket}`);
    return place.before;
  };
  return { done, before, stop: () => transfer.abort() };
}

/**
 * @template Answer
 * @param {number} status
 * @param {string} text
 * @returns {Answer}
 */
function read(status, text) {
  let answer = null;
  try {
    answer = text === "" ? null : JSON.parse(text);
  } catch {
    // Not ours (a proxy's page, say): the status has to speak for itself.
  }
  if (status >= 200 && status < 300) return answer;
  throw new ApiError(status, answer?.error ?? { message: `The server answered with status ${status}` });
}

/**
 * A query as addresses have it.
 *
 * @param {Query} values
 */
export function query(values) {
  return new URLSearchParams(Object.entries(values).map(([name, value]) => [name, String(value)])).toString();
}

/**
 * The path of one thing of a kind, and of what belongs to it.
 *
 * @param {string} kind
 */
export function pathOf(kind) {
  return (/** @type {string} */ id, /** @type {string[]} */ ...rest) => [kind, encodeURIComponent(id), ...rest].join("/");
}

const session = pathOf("sessions");
const run = pathOf("runs");
const upload = pathOf("uploads");
const failure = pathOf("failures");
const savedComparison = pathOf("comparisons/saved");
const experimentPath = pathOf("experiments");
/** @param {string} name @param {string} plot */
const exportPath = (name, plot) => `exports/${encodeURIComponent(name)}${plot ? `?${query({ plot })}` : ""}`;
/** @param {string} id @param {string} of The experiment. @param {string} form */
const truthPath = (id, of, form = "truth") => upload(id, `${form}?${query({ experiment: of })}`);

/**
 * @typedef {object} Api Every request that the pages make, but for those of sweeps.
 * @property {() => Promise<Messages.ExperimentPublic[]>} experiments
 * @property {() => Promise<Messages.Section[]>} glossary
 * @property {(id: string, recording?: string) => Promise<Messages.ExperimentDetail>} experiment With the parameters of a kind of recording, if one is named.
 * @property {() => Promise<Messages.Plugin[]>} plugins
 * @property {() => Promise<Messages.CompilationPublic>} compilation
 * @property {() => Promise<Messages.FilterPublic[]>} filters
 * @property {(name: string, text: string, before: string) => Promise<Messages.FilterPublic>} writeFilter
 * @property {(runs: Messages.ComparedRun[], frames?: number) => Promise<Messages.SourceCode>} sourceCode
 * @property {() => Promise<Messages.FailurePublic[]>} failures
 * @property {(id: string) => Promise<Messages.FailurePublic>} failure By id or number.
 * @property {(id: string, signal: AbortSignal) => Promise<Messages.FailureResult>} course
 * @property {(id: string) => Promise<Messages.SessionPublic>} session
 * @property {() => Promise<Messages.SessionPublic[]>} sessions
 * @property {(body: Messages.SessionCreate) => Promise<Messages.SessionPublic>} start
 * @property {(id: string) => Promise<null>} end
 * @property {(id: string, name: string) => Promise<Messages.SessionPublic>} renameSession
 * @property {(id: string, command: Messages.Command) => Promise<Messages.CommandAnswer>} command
 * @property {(id: string) => Promise<Messages.SessionPublic>} resume
 * @property {(id: string, branch: string) => Promise<Messages.Columns>} diagnostics
 * @property {(id: string, note: string) => Promise<Messages.Bookmark>} bookmark
 * @property {(id: string, bookmark: string) => Promise<null>} unbookmark
 * @property {(id: string, frame?: number) => Promise<Messages.Explanation>} explanation Of the first lasting loss, or at a frame.
 * @property {(id: string) => string} frameAddress
 * @property {(files: File[], onProgress: OnProgress, columns?: Record<string, number>) => Transfer<Messages.UploadPublic>} sendUpload
 * @property {(text: string) => Promise<Messages.Preview>} table
 * @property {(id: string) => Promise<Messages.UploadPublic>} upload
 * @property {(id: string, question: Query) => Promise<Messages.SightingPublic>} mark
 * @property {(id: string, question: Query, signal: AbortSignal) => Promise<Messages.SuitabilityPublic>} suitability
 * @property {(id: string, experiment: string) => Promise<Messages.TruthPublic|null>} truth
 * @property {(id: string, files: File[]) => Promise<Messages.TruthPublic>} giveSessionTruth
 * @property {(id: string, experiment: string, files: File[]) => Promise<Messages.TruthPublic>} giveTruth
 * @property {(id: string, experiment: string) => Promise<null>} removeTruth
 * @property {(id: string, experiment: string) => Promise<{name: string, content: Blob}>} truthTable
 * @property {(id: string, experiment: string) => string} truthAddress
 * @property {(id: string) => Promise<null>} removeUpload
 * @property {(id: string, frame: number) => string} pictureAddress
 * @property {(question: Query, signal: AbortSignal) => Promise<Messages.WorkPublic>} work
 * @property {(session: string) => Promise<Messages.RunPublic>} save
 * @property {(files: File[], onProgress: OnProgress) => Transfer<Messages.ImportJob>} importRun
 * @property {(id: string) => Promise<Messages.SessionPublic>} open
 * @property {(id: string, title: string) => Promise<Messages.RunPublic>} renameRun
 * @property {(id: string) => Promise<null>} remove
 * @property {(id: string) => string} downloadAddress
 * @property {(body: Messages.SavedComparisonCreate) => Promise<Messages.SavedComparisonPublic>} saveComparison
 * @property {(id: string) => Promise<Messages.SavedComparisonDetail>} savedComparison
 * @property {(id: string, title: string) => Promise<Messages.SavedComparisonPublic>} renameComparison
 * @property {(id: string) => Promise<null>} removeComparison
 * @property {(name: string, body: Messages.ComparisonExportCreate) => Promise<Messages.ExportJob>} exportComparison
 * @property {(id: string, name: string, plot: string) => Promise<Messages.ExportJob>} exportSession
 * @property {(id: string, name: string, plot: string) => Promise<Messages.ExportJob>} exportRun
 * @property {(id: string) => Promise<Messages.ExportsPublic>} exportsOfRun
 * @property {(id: string, numbers: string[]) => Promise<Messages.FitJob>} fit
 */

/** @type {Api} */
export const api = {
  experiments: () => request("GET", "experiments"),
  glossary: () => request("GET", "glossary"),
  experiment: (id, recording) => request("GET", recording ? `${experimentPath(id)}?${query({ recording })}` : experimentPath(id)),
  plugins: () => request("GET", "plugins"),
  compilation: () => request("GET", "compilation"),
  filters: () => request("GET", "filters"),
  writeFilter: (name, text, before) => request("PUT", `filters/${encodeURIComponent(name)}`, { text, before }),
  sourceCode: (runs, frames) => request("POST", "source-code", { runs, frames: frames ?? null }),

  failures: () => request("GET", "failures"),
  failure: (id) => request("GET", failure(id)),
  course: (id, signal) => request("GET", failure(id, "course"), undefined, signal),

  session: (id) => request("GET", session(id)),
  sessions: () => request("GET", "sessions"),
  start: (body) => request("POST", "sessions", body),
  end: (id) => request("DELETE", session(id)),
  renameSession: (id, name) => request("PATCH", session(id), { name }),
  command: (id, command) => request("POST", session(id, "commands"), command),
  resume: (id) => request("POST", session(id, "resume")),
  diagnostics: (id, branch) => request("GET", session(id, `diagnostics?branch=${encodeURIComponent(branch)}`)),
  bookmark: (id, note) => request("POST", session(id, "bookmarks"), note ? { note } : {}),
  unbookmark: (id, bookmark) => request("DELETE", session(id, `bookmarks/${encodeURIComponent(bookmark)}`)),
  explanation: (id, frame) => request("GET", session(id, frame === undefined ? "explanation" : `explanation?frame=${frame}`)),
  frameAddress: (id) => `${ROOT}${session(id, "frame.png")}`,

  sendUpload: (files, onProgress, columns) => send(columns ? `uploads?${query({ columns: JSON.stringify(columns) })}` : "uploads", files, onProgress),
  table: (text) => request("POST", "uploads/table", { text }),
  upload: (id) => request("GET", upload(id)),
  mark: (id, question) => request("GET", upload(id, `mark?${query(question)}`)),
  suitability: (id, question, signal) => request("GET", upload(id, `suitability?${query(question)}`), undefined, signal),
  truth: (id, experiment) => request("GET", truthPath(id, experiment)),
  giveSessionTruth: (id, files) => send(session(id, "truth"), files, () => {}, "PUT").done,
  giveTruth: (id, experiment, files) => send(truthPath(id, experiment), files, () => {}, "PUT").done,
  removeTruth: (id, experiment) => request("DELETE", truthPath(id, experiment)),
  truthTable: (id, experiment) => fetched(truthPath(id, experiment, "truth.csv")),
  truthAddress: (id, experiment) => `${ROOT}${truthPath(id, experiment, "truth.csv")}`,
  removeUpload: (id) => request("DELETE", upload(id)),
  pictureAddress: (id, frame) => `${ROOT}${upload(id, `frames/${frame}.jpg`)}`,

  work: (question, signal) => request("GET", `work?${query(question)}`, undefined, signal),
  save: (sessionId) => request("POST", "runs", { session: sessionId }),
  importRun: (files, onProgress) => send("runs/import", files, onProgress),
  open: (id) => request("POST", run(id, "open")),
  renameRun: (id, title) => request("PATCH", run(id), { title }),
  remove: (id) => request("DELETE", run(id)),
  exportSession: (id, name, plot) => request("POST", session(id, exportPath(name, plot))),
  exportRun: (id, name, plot) => request("POST", run(id, exportPath(name, plot))),
  exportsOfRun: (id) => request("GET", run(id, "exports")),
  fit: (id, numbers) => request("POST", session(id, "fits"), { numbers }),
  saveComparison: (body) => request("POST", "comparisons/saved", body),
  savedComparison: (id) => request("GET", savedComparison(id)),
  renameComparison: (id, title) => request("PATCH", savedComparison(id), { title }),
  exportComparison: (name, body) => request("POST", `comparisons/${exportPath(name, "")}`, body),
  removeComparison: (id) => request("DELETE", savedComparison(id)),
  downloadAddress: (id) => `${ROOT}${run(id, "download")}`,
};

// Jobs: work on the server that takes a while, which is asked for how far it is until it has ended.

/** The first answer is soon asked for, since much takes a moment only. */
const ASK_FIRST_MS = 50;
const ASK_EVERY_MS = 250;
const NOT_FOUND = 404;
/** A rate is a rate only after a while. */
const RATE_AFTER_S = 2;

const job = pathOf("jobs");

/**
 * @template {Job} T
 * @param {string} id
 * @returns {Promise<T>}
 */
export function jobOf(id) {
  return request("GET", job(id));
}

/**
 * Stop a job, or have the server forget it. The request outlives the page, and nobody waits for its answer.
 *
 * @param {string} id
 */
export function cancelJob(id) {
  fetch(ROOT + job(id), { method: "DELETE", keepalive: true }).catch(() => {});
}

/**
 * Follow a job until it ends; null if the caller stopped it.
 *
 * @template {Job} T
 * @param {T} begun
 * @param {(now: T|null) => void} tell Hears how far it is, also in the end; null where the server does not answer and is asked again.
 * @param {AbortSignal} signal Ends the asking; the job itself goes on until it is cancelled.
 * @param {() => Promise<T>} [again] Begins it anew where the server does not know it any more, as after a restart.
 * @returns {Promise<T|null>}
 */
export async function followJob(begun, tell, signal, again) {
  let known = begun;
  for (let wait = ASK_FIRST_MS; known.state === "working"; wait = Math.min(2 * wait, ASK_EVERY_MS)) {
    await after(wait);
    if (signal.aborted) return null;
    /** @type {T|null} */
    const now = await ask(known.id, again);
    if (signal.aborted) return null;
    tell(now);
    known = now ?? known;
  }
  return signal.aborted ? null : known;
}

/**
 * "Computing frame 1,200 of 4,000, about 40 s left".
 *
 * @param {number} frame
 * @param {number} goal
 * @param {number} seconds Since it began.
 * @param {number} frames Computed since then.
 */
export function progressWords(frame, goal, seconds, frames) {
  const place = `Computing frame ${frame.toLocaleString("en")} of ${goal.toLocaleString("en")}`;
  if (seconds < RATE_AFTER_S || frames <= 0) return place;
  return `${place}, about ${duration((seconds * (goal - frame)) / frames)} left`;
}

/** @param {{share: number|null, label: string}} props How far something is; it only moves while the share is not known. */
export function Meter({ share, label }) {
  return html`<progress key=${share === null ? "moving" : "known"} max="1" value=${share ?? undefined} aria-label=${label}></progress>`;
}

/**
 * An answer; null where there was none, since the server can be asked again.
 *
 * @template {Job} T
 * @param {string} id
 * @param {() => Promise<T>} [again]
 * @returns {Promise<T|null>}
 */
async function ask(id, again) {
  try {
    /** @type {T} */
    const now = await jobOf(id);
    return now;
  } catch (error) {
    if (statusOf(error) === NOT_FOUND && again) return again();
    if (statusOf(error) === 0) return null;
    throw error;
  }
}
