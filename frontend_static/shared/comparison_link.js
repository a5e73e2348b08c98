/**
 * Addresses of comparisons. `?runs=a,b` names runs that are here by references; what makes them travels in the fragment,
 * which no server logs, so that a link shows the same wherever it is opened.
 */

import { encode, parse } from "./share_link.js";

/** @import { ComparedRun } from "./messages.js" */

/** @typedef {"side"|"over"} Arrangement Side by side, or one over the other. */

/**
 * What an address says.
 *
 * @typedef {object} Wanted
 * @property {ComparedRun[]} runs
 * @property {number} [position] The frame to begin at, of those that all runs have.
 * @property {Arrangement} [arrangement]
 * @property {string} [title] The title that a person gave.
 */

const PAGE = "compare";

/**
 * Read the address of a page.
 *
 * @param {{search: string, hash: string}} address
 * @returns {Wanted|null} Null where it names no runs.
 * @throws {Error} The link is damaged.
 */
export function wantedOf({ search, hash }) {
  if (hash.length > 1) return damagedOr(() => checked(/** @type {Wanted} */ (parse(hash))));
  const query = new URLSearchParams(search);
  const references = (query.get("runs") ?? "").split(",").filter(Boolean);
  if (references.length === 0) return null;
  return { runs: references.map((reference) => ({ reference })), position: Number(query.get("frame")) || 0 };
}

/**
 * The saved comparison that the address of a page names, if it does.
 *
 * @param {{search: string, hash: string}} address
 */
export function savedOf({ search, hash }) {
  return hash.length > 1 ? null : new URLSearchParams(search).get("saved");
}

/**
 * A link that holds all that makes the runs.
 *
 * @param {Wanted} wanted
 */
export function linkTo({ runs, position = 0, arrangement = "side", title = "" }) {
  const more = { ...(position > 0 && { position }), ...(arrangement !== "side" && { arrangement }), ...(title && { title }) };
  return `${PAGE}#${encode({ runs, ...more })}`;
}

/**
 * A link by references to runs of this server.
 *
 * @param {readonly string[]} references
 * @param {number} [frame]
 */
export function linkToReferences(references, frame = 0) {
  return `${PAGE}?runs=${references.map(encodeURIComponent).join(",")}${frame > 0 ? `&frame=${frame}` : ""}`;
}

/**
 * @param {Wanted} wanted
 * @returns {Wanted}
 */
function checked({ runs, position, arrangement, title }) {
  if (!Array.isArray(runs) || !runs.every((run) => typeof run === "object" && run !== null)) throw new Error("no runs");
  return {
    runs,
    position: Number.isInteger(position) ? position : 0,
    arrangement: arrangement === "over" ? "over" : "side",
    ...(typeof title === "string" && title !== "" && { title }),
  };
}

/**
 * @template Read
 * @param {() => Read} read
 */
function damagedOr(read) {
  try {
    return read();
  } catch {
    throw new Error("The link is damaged: a part of it is missing after the # sign, or was changed. Copy the whole link again.");
  }
}
