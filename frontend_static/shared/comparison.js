/** From a session to a comparison: with its branches, with the same run by other trackers, or with other sessions. */

import { h, html, useSignal } from "../vendor/preact.js";
import { request } from "./api.js";
import { openDialog } from "./dialog.js";
import { Boxes } from "./dom.js";
import { encode, parse } from "./share_link.js";

/** @import { BranchPublic, ComparedRun, SessionPublic } from "./messages.js" */

// Addresses of comparisons. `?runs=a,b` names runs on this server by references; recipes are in the fragment, which no server logs, so that
// a link shows the same on any server.

/** @typedef {"side"|"over"} Arrangement Side by side, or one over the other. */

/** The content of an address.
 *
 * @typedef {object} Wanted
 * @property {ComparedRun[]} runs
 * @property {number} [position] The first frame to show, among the common ones.
 * @property {Arrangement} [arrangement]
 * @property {string} [title] The title that a person gave.
 */

const PAGE = "compare";

/**
 * Read the address of a page.
 *
 * @param {{search: string, hash: string}} address
 * @returns {Wanted|null} Null if it names no runs.
 * @throws {Error} The link is damaged.
 */
export function wantedOf({ search, hash }) {
  if (hash.length > 1) return damagedOr(() => checked(/** @type {Wanted} */ (parse(hash))));
  const query = new URLSearchParams(search);
  const references = (query.get("runs") ?? "").split(",").filter(Boolean);
  if (references.length === 0) return null;
  return { runs: references.map((reference) => ({ reference })), position: Number(query.get("frame")) || 0 };
}

/** The saved comparison named by a page's address, if any.
 *
 * @param {{search: string, hash: string}} address
 */
export function savedOf({ search, hash }) {
  return hash.length > 1 ? null : new URLSearchParams(search).get("saved");
}

/** A link with the recipes of all runs.
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
export function damagedOr(read) {
  try {
    return read();
  } catch {
    throw new Error("The link is damaged: a part of it is missing after the # sign, or was changed. Copy the whole link again.");
  }
}

const MOST_OTHERS = 3;
const MOST_SESSIONS = 8;
const SAVED = "Saved runs are compared in My work, trackers over many conditions in a sweep.";

/** @typedef {{reference: string, title: string, hint: string, colour?: string, isChosen: boolean}} Other What this run can be compared with. */

/** Ask which runs to compare with the shown one.
 *
 * @param {SessionPublic} session
 */
export async function compareDialog(session) {
  const sessions = await request("GET sessions").catch(() => []);
  const within = [...branchesOf(session), ...methodsOf(session)];
  const others = [...within, ...sessionsBeside(session, sessions, within.length === 0)];
  openDialog("Compare this run", (close) => h(Choices, { session, others, close }), "wide");
}

/** @param {{session: SessionPublic, others: readonly Other[], close: () => void}} props */
function Choices({ session, others, close }) {
  const chosen = useSignal(others.filter(({ isChosen }) => isChosen).map(({ reference }) => reference));
  const options = others.map(({ reference, title, hint, colour }) => {
    const swatch = colour && html`<span class="swatch" style=${{ background: colour }}></span>`;
    return { value: reference, words: html`${swatch}<span>${title}</span><span class="hint">${hint}</span>` };
  });
  const choose = (/** @type {string[]} */ some) => (chosen.value = some);
  const compare = () => location.assign(linkToReferences([`${session.id}:${session.branch}`, ...chosen.value], session.position));
  return html`<form method="dialog" onSubmit=${compare}>
    <p>It is shown with up to three others, on the same frames, in step. This session continues unchanged.</p>
    ${others.length === 0 && html`<p class="note">Nothing to compare with yet: no branch, no other tracker or session of this kind.</p>`}
    <div class="compare-choices">${h(Boxes, { options, chosen: chosen.value, choose, most: MOST_OTHERS })}</div>
    <p class="hint">${SAVED}</p>
    <footer>
      <button type="button" onClick=${close}>Cancel</button>
      <button type="submit" class="primary" autofocus disabled=${chosen.value.length === 0}>Compare</button>
    </footer>
  </form>`;
}

/**
 * The other branches; the one that this one left comes first, and is chosen.
 *
 * @param {SessionPublic} session
 * @returns {Other[]}
 */
function branchesOf({ id, branch: active, branches }) {
  const own = branches.find((branch) => branch.id === active);
  const isNear = (/** @type {BranchPublic} */ branch) => branch.id === own?.parent || branch.parent === active;
  const others = branches.filter((branch) => branch !== own).sort((a, b) => Number(isNear(b)) - Number(isNear(a)));
  return others.map((branch, place) => ({
    reference: `${id}:${branch.id}`,
    title: branch.title,
    hint: branch.parent === null ? "the original run" : `branched from frame ${branch.frame}`,
    colour: branch.colour,
    isChosen: place === 0,
  }));
}

/** Other sessions of the same experiment, on a recording if this one is; newest first.
 *
 * @param {SessionPublic} session
 * @param {SessionPublic[]} all The newest first.
 * @param {boolean} alone Whether there is nothing else to compare with; the newest is then chosen.
 * @returns {Other[]}
 */
export function sessionsBeside(session, all, alone) {
  const isLike = (/** @type {SessionPublic} */ { id, recipe }) =>
    id !== session.id && recipe.experiment === session.recipe.experiment && Boolean(recipe.footage) === Boolean(session.recipe.footage);
  return all.filter(isLike).slice(0, MOST_SESSIONS).map(({ id, branch, name, title, recipe }, place) => ({
    reference: `${id}:${branch}`,
    title: name || title,
    hint: `another session, seed ${recipe.seed}`,
    isChosen: alone && place === 0,
  }));
}

/** The same run with other trackers from frame 0, with the same random numbers.
 *
 * @param {SessionPublic} session
 * @returns {Other[]}
 */
function methodsOf({ id, branch, branches, recipe, trackers }) {
  const others = trackers.filter((tracker) => tracker.id !== recipe.tracker);
  return others.map((tracker, place) => ({
    reference: `${id}:${branch}:${tracker.id}`,
    title: tracker.title,
    hint: "same seed, from frame 0 on",
    isChosen: branches.length === 1 && place === 0,
  }));
}
