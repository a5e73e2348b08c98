/**
 * The server's REST interface. Every failure is an `ApiError` whose message can be shown unchanged. */

import { html } from "../vendor/preact.js";
import { duration } from "./format.js";
import { after } from "./timing.js";

/** @import * as Messages from "./messages.js" */
/** @import { Job } from "./messages.js" */

// Addresses. The server may be below any path, and a class below its link: each page has the prefix in its `<base>`, and all addresses in
// pages and scripts are relative to that, as in `session/1f`. So a bare `#there` would lead to another page.

/** The start page, or for a participant that of the class. */
export const START = "./";

/** An absolute address that can be opened elsewhere.
 *
 * @param {string} address Address relative to the server.
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

/** @typedef {keyof Messages.Requests} Route Method and path of a request, whose names in braces stand for what it is about. */
/** The arguments of a request: names in its path, its query, its body, and a signal that aborts it.
 *
 * @template {Route} R
 * @typedef {Messages.Requests[R]["asked"] & {signal?: AbortSignal}} Asked
 */
/** These arguments, optional if all are.
 *
 * @template {Route} R
 * @typedef {{} extends Asked<R> ? [asked?: Asked<R>] : [asked: Asked<R>]} Given
 */
/**
 * @template Answer
 * @typedef {object} Transfer
 * @property {Promise<Answer>} done
 * @property {() => Promise<number>} before Number of requests before this one in the server's queue, once it is complete.
 * @property {() => void} stop
 */

const NOT_FOUND = 404;

/** Prefix of the interface. */
const ROOT = "api/v1/";

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

/** The server's status of a refusal, or undefined for any other error.
 *
 * @param {unknown} error
 */
export function statusOf(error) {
  return error instanceof ApiError ? error.status : undefined;
}

/**
 * The URL of a request, relative to the `<base>`. Null and undefined parameters are left out.
 *
 * @throws {ApiError} A path parameter is missing or would change the route.
 * @template {Route} R
 * @param {R} route
 * @param {Given<R>} given
 */
export function addressOf(route, ...[given = /** @type {Asked<R>} */ ({})]) {
  const { body: _, signal: __, ...said } = /** @type {{body?: unknown, signal?: AbortSignal, [name: string]: unknown}} */ (given);
  const names = new Map(Object.entries(said).filter(([, value]) => value !== undefined && value !== null));
  const path = route.slice(route.indexOf(" ") + 1).replace(/\{(\w+)\}/g, (_whole, name) => {
    const value = String(names.get(name) ?? "");
    // A browser resolves "." and "..", which would lead to another route.
    if (/^\.{0,2}$/.test(value)) throw new ApiError(NOT_FOUND, { message: `Not a valid ${name}: "${value}"` });
    names.delete(name);
    return encodeURIComponent(value);
  });
  const query = new URLSearchParams(Array.from(names, ([name, value]) => [name, String(value)]));
  return `${ROOT}${path}${names.size > 0 ? `?${query}` : ""}`;
}

/**
 * Handlers that replace the server on an exported page, by route.
 *
 * @type {{[R in Route]?: (asked: Asked<R>) => Promise<Messages.Requests[R]["answer"]>}}
 */
export const answers = {};

/** @param {Route} route */
function methodOf(route) {
  return route.slice(0, route.indexOf(" "));
}

/**
 * Send a request and return its answer: JSON, the text of a file, or null if it is empty.
 *
 * @throws {ApiError} The server refused, or did not answer (status 0).
 * @template {Route} R
 * @param {R} route
 * @param {Given<R>} given A file or a form is sent as it is, any other body as JSON.
 * @returns {Promise<Messages.Requests[R]["answer"]>}
 */
export async function request(route, ...given) {
  const answer = answers[route];
  if (answer) return answer(/** @type {Asked<R>} */ (given[0]));
  const { body, signal = null } = /** @type {{body?: unknown, signal?: AbortSignal}} */ (given[0] ?? {});
  const raw = body instanceof Blob || body instanceof FormData ? body : null;
  const headers = { accept: "application/json", ...(body !== undefined && raw === null && { "content-type": "application/json" }) };
  const options = { method: methodOf(route), headers, signal, body: raw ?? JSON.stringify(body) };
  const address = addressOf(route, ...given);
  let response;
  let text;
  try {
    response = await fetch(address, options);
    text = await response.text();
  } catch {
    throw new ApiError(0, { message: "The server does not answer" });
  }
  return read(response.status, text, response.headers.get("content-type"));
}

/** Send a request that outlives the page, without waiting for the answer.
 *
 * @template {Route} R
 * @param {R} route
 * @param {Given<R>} given
 */
export function forget(route, ...given) {
  fetch(addressOf(route, ...given), { method: methodOf(route), keepalive: true }).catch(() => {});
}

/**
 * @param {string} session
 * @param {Messages.Command} body
 */
export function sendCommand(session, body) {
  return request("POST sessions/{session}/commands", { session, body });
}

/** @param {Iterable<File>} files */
export function formOf(files) {
  const form = new FormData();
  for (const file of files) form.append("file", file, file.name);
  return form;
}

/**
 * Send files with progress, which `fetch` cannot report.
 *
 * @template {"POST uploads"|"POST runs/import"} R
 * @param {R} route
 * @param {Asked<R>} asked
 * @param {Iterable<File>} files
 * @param {(sent: number, total: number) => void} onProgress In bytes, including the form around the files.
 * @returns {Transfer<Messages.Requests[R]["answer"]>}
 */
export function send(route, asked, files, onProgress) {
  const ticket = `${Date.now()}-${Math.random().toString(36).slice(2)}`;
  const transfer = new XMLHttpRequest();
  /** @type {Promise<Messages.Requests[R]["answer"]>} */
  const done = new Promise((resolve, reject) => {
    transfer.upload.addEventListener("progress", (event) => onProgress(event.loaded, event.total));
    transfer.addEventListener("load", () => {
      try {
        resolve(read(transfer.status, transfer.responseText, transfer.getResponseHeader("content-type")));
      } catch (error) {
        reject(error);
      }
    });
    transfer.addEventListener("error", () => reject(new ApiError(0, { message: "The connection broke during the upload" })));
    transfer.addEventListener("abort", () => reject(new ApiError(-1, { message: "The upload was stopped" })));
    const address = addressOf(route, /** @type {Asked<R>} */ ({ ...asked, ticket }));
    transfer.open(methodOf(route), address);
    transfer.setRequestHeader("accept", "application/json");
    transfer.send(formOf(files));
  });
  const before = async () => (await request("GET queue/{ticket}", { ticket })).before;
  return { done, before, stop: () => transfer.abort() };
}

/**
 * @template Answer
 * @param {number} status
 * @param {string} text
 * @param {string|null} type Content type of the answer.
 * @returns {Answer}
 */
function read(status, text, type) {
  const isFine = status >= 200 && status < 300;
  let answer = null;
  try {
    answer = text === "" ? null : JSON.parse(text);
  } catch {
    // A file of text; a page (HTML) is a proxy's answer, not the server's.
    if (isFine && (type === null || /html|json/.test(type))) throw new ApiError(0, { message: `Expected JSON from the server, got ${type}` });
    if (isFine) answer = text;
  }
  if (isFine) return answer;
  throw new ApiError(status, answer?.error ?? { message: `The server answered with status ${status}` });
}

// Jobs: long work on the server, polled for progress until it ends.

/** Delay of the first poll, short since many jobs take only a moment. */
const ASK_FIRST_MS = 50;
const ASK_EVERY_MS = 250;
/** Time after which a rate is meaningful. */
const RATE_AFTER_S = 2;

/**
 * @template {Job} T
 * @param {string} job
 * @returns {Promise<T>}
 */
export async function jobOf(job) {
  return /** @type {T} */ (await request("GET jobs/{job}", { job }));
}

/** @param {string} job The server stops or forgets it. */
export function cancelJob(job) {
  forget("DELETE jobs/{job}", { job });
}

/**
 * Follow a job until it ends; null if the caller stopped it.
 *
 * @template {Job} T
 * @param {T} begun
 * @param {(now: T|null) => void} tell Called with the progress, also at the end; null while the server does not answer.
 * @param {AbortSignal} signal Ends the polling; the job continues until it is cancelled.
 * @param {() => Promise<T>} [again] Begins it again if the server no longer knows it, as after a restart.
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
 * @param {number} seconds Seconds since the start.
 * @param {number} frames Frames computed since then.
 */
export function progressWords(frame, goal, seconds, frames) {
  const place = `Computing frame ${frame.toLocaleString("en")} of ${goal.toLocaleString("en")}`;
  if (seconds < RATE_AFTER_S || frames <= 0) return place;
  return `${place}, about ${duration((seconds * (goal - frame)) / frames)} left`;
}

/** @param {{share: number|null, label: string}} props A progress bar; it is indeterminate while the share is unknown. */
export function Meter({ share, label }) {
  return html`<progress key=${share === null ? "moving" : "known"} max="1" value=${share ?? undefined} aria-label=${label}></progress>`;
}

/** An answer; null if there was none, since the request can be repeated.
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
