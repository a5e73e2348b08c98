/** What the server knows of sweeps. */

import { request } from "../shared/api.js";
import { encode } from "../shared/share_link.js";

/** @import * as Messages from "../shared/messages.js" */

/** @param {string} id @param {string} [rest] */
const sweep = (id, rest = "") => `sweeps/${encodeURIComponent(id)}${rest}`;

/**
 * @typedef {object} Sweeps Every request about sweeps.
 * @property {(experiment: string) => Promise<Messages.SweepCreate>} example
 * @property {(plan: object, measure: boolean) => Promise<Messages.EstimatePublic>} estimate
 * @property {(plan: object) => Promise<Messages.SweepPublic>} begin
 * @property {() => Promise<Messages.SweepPublic[]>} list
 * @property {(id: string) => Promise<Messages.SweepPublic>} show
 * @property {(id: string) => Promise<Messages.SweepPublic>} cancel
 * @property {(id: string) => Promise<Messages.SweepPublic>} resume
 * @property {(id: string) => Promise<null>} remove
 * @property {(id: string, query: Record<string, any>) => Promise<Messages.CellsPublic>} cells
 * @property {(id: string, query: Record<string, any>) => Promise<Messages.RowsPublic>} rows
 * @property {(id: string, run: string|number, tracker?: string|null) => Promise<Messages.SessionPublic>} open
 * @property {(id: string, format: string) => string} downloadAddress
 */

/** @type {Sweeps} */
export const sweeps = {
  example: (experiment) => request("GET", `experiments/${encodeURIComponent(experiment)}/sweep`),
  estimate: (body, measure) => request("POST", "sweeps/estimate", { ...body, measure }),
  begin: (body) => request("POST", "sweeps", body),
  list: () => request("GET", "sweeps"),
  show: (id) => request("GET", sweep(id)),
  cancel: (id) => request("POST", sweep(id, "/cancel")),
  resume: (id) => request("POST", sweep(id, "/resume")),
  remove: (id) => request("DELETE", sweep(id)),
  cells: (id, query) => request("GET", sweep(id, `/cells?${new URLSearchParams(query)}`)),
  rows: (id, query) => request("GET", sweep(id, `/rows?${new URLSearchParams(query)}`)),
  open: (id, run, tracker) => request("POST", sweep(id, `/rows/${run}/open`), tracker ? { tracker } : {}),
  downloadAddress: (id, format) => `/api/v1/${sweep(id, `/download?format=${format}`)}`,
};

/** Where the stream of a sweep is found, over the axes that shall be seen. */
export function sweepStream(id, { x, y }) {
  const scheme = location.protocol === "https:" ? "wss:" : "ws:";
  return `${scheme}//${location.host}/api/v1/${sweep(id, "/stream")}?${new URLSearchParams({ x, y })}`;
}

/** The page that opens a run as a session; with another method where one is named. */
export function runPage(id, run, tracker) {
  const query = tracker ? `?${new URLSearchParams({ tracker })}` : "";
  return `/sweep/${encodeURIComponent(id)}/run/${run}${query}`;
}

/** The form of a new sweep, filled in. */
export function newSweep(body) {
  return `/sweep/new#${encode(body)}`;
}
