/** The recipe of a session in the fragment of a link, which no server logs. */

/** @import { Preset, SessionCreate, SweepCreate } from "./messages.js" */

/** @typedef {SessionCreate & {play?: boolean}} NewSession What POST sessions takes, and whether the session shall play. */

/**
 * Link to a new session.
 *
 * @param {NewSession} body
 */
export function linkTo(body) {
  return `session/new#${encode(body)}`;
}

/** The recipe of an experiment's preset.
 *
 * @param {{id: string}} experiment
 * @param {Pick<Preset, "tracker"|"seed"|"parameters">} preset
 */
export function presetRecipe({ id }, { tracker, seed, parameters }) {
  return { experiment: id, tracker, seed, timeline: [{ frame: 0, values: parameters }] };
}

/** A link to the filled-in form of a new sweep.
 *
 * @param {{experiment: string}|Partial<SweepCreate>} body
 */
export function newSweep(body) {
  return `sweep/new#${encode(body)}`;
}

/**
 * base64url of JSON, in UTF-8.
 *
 * @template Body
 * @param {Body} body
 */
export function encode(body) {
  // Letter by letter: a run with thousands of changes has more letters than a call can take arguments.
  const raw = Array.from(new TextEncoder().encode(JSON.stringify(body)), (code) => String.fromCharCode(code));
  return btoa(raw.join("")).replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
}

/** Read a fragment. The server checks the rest of it.
 *
 * @template Body
 * @param {string} fragment
 * @returns {Body}
 * @throws {Error} The fragment holds no experiment.
 */
export function decode(fragment) {
  const body = parse(fragment);
  // A link of an earlier version has no recipe; the server understands it.
  if (typeof (body?.recipe ?? body)?.experiment !== "string") throw new Error("no experiment");
  return body;
}

/**
 * The JSON of any fragment.
 *
 * @param {string} fragment
 * @throws {Error} The fragment does not hold JSON.
 */
export function parse(fragment) {
  const raw = atob(fragment.replace(/^#/, "").replaceAll("-", "+").replaceAll("_", "/"));
  return JSON.parse(new TextDecoder().decode(Uint8Array.from(raw, (letter) => letter.charCodeAt(0))));
}
