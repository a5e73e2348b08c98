/** What the server knows of sweeps. */

import { ROOT, pathOf, query, request } from "../shared/api.js";
import { socketAddress } from "../shared/socket.js";

/** @import { Query } from "../shared/api.js" */
/** @import * as Messages from "../shared/messages.js" */

/**
 * A plan as it is typed in: an empty field is null, and the server says what is missing.
 *
 * @typedef {{[Name in keyof Messages.SweepCreate]: Messages.SweepCreate[Name]|null}} Plan
 */

const sweep = pathOf("sweeps");

/**
 * @typedef {object} Sweeps Every request about sweeps.
 * @property {(experiment: string) => Promise<Messages.SweepCreate>} example
 * @property {(plan: Plan, measure: boolean) => Promise<Messages.EstimatePublic>} estimate
 * @property {(plan: Plan) => Promise<Messages.SweepPublic>} begin
 * @property {(id: string) => Promise<Messages.SweepPublic>} cancel
 * @property {(id: string) => Promise<Messages.SweepPublic>} resume
 * @property {(id: string) => Promise<null>} remove
 * @property {(id: string, question: Query) => Promise<Messages.CellsPublic>} cells
 * @property {(id: string, question: Query) => Promise<Messages.RowsPublic>} rows
 * @property {(id: string, run: string|number, tracker?: string|null) => Promise<Messages.SessionPublic>} open
 * @property {(id: string) => Promise<import("../shared/messages.js").SourceCode>} sourceCode
 * @property {(id: string, format: string) => string} downloadAddress
 */

/** @type {Sweeps} */
export const sweeps = {
  example: (experiment) => request("GET", `experiments/${encodeURIComponent(experiment)}/sweep`),
  estimate: (body, measure) => request("POST", "sweeps/estimate", { ...body, measure }),
  begin: (body) => request("POST", "sweeps", body),
  cancel: (id) => request("POST", sweep(id, "cancel")),
  resume: (id) => request("POST", sweep(id, "resume")),
  remove: (id) => request("DELETE", sweep(id)),
  cells: (id, question) => request("GET", sweep(id, `cells?${query(question)}`)),
  rows: (id, question) => request("GET", sweep(id, `rows?${query(question)}`)),
  open: (id, run, tracker) => request("POST", sweep(id, "rows", encodeURIComponent(run), "open"), tracker ? { tracker } : {}),
  sourceCode: (id) => request("GET", sweep(id, "source-code")),
  downloadAddress: (id, format) => `${ROOT}${sweep(id, `download?format=${format}`)}`,
};

/**
 * Where the stream of a sweep is found, over the axes that shall be seen.
 *
 * @param {string} id
 * @param {{x?: string, y?: string}} axes
 */
export function sweepStream(id, axes) {
  return socketAddress(sweep(id, `stream?${query(axes)}`));
}

/**
 * The page that opens a run as a session; with another method where one is named.
 *
 * @param {string} id
 * @param {number} run
 * @param {string} [tracker]
 */
export function runPage(id, run, tracker) {
  return `sweep/${encodeURIComponent(id)}/run/${run}${tracker ? `?${query({ tracker })}` : ""}`;
}

/**
 * "h-SPF" of "Hard switching (h-SPF)".
 *
 * @param {string} title Of a tracker.
 */
export function shortTitle(title) {
  return /\(([^)]+)\)$/.exec(title)?.[1] ?? title;
}
