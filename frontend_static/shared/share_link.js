/** What a session shall be like, as it travels in the fragment of a link, which no server logs. */

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

/**
 * What makes the run of an experiment's preset.
 *
 * @param {{id: string}} experiment
 * @param {Pick<Preset, "tracker"|"seed"|"parameters">} preset
 */
export function presetRecipe({ id }, { tracker, seed, parameters }) {
  return { experiment: id, tracker, seed, timeline: [{ frame: 0, values: parameters }] };
}

/**
 * The form of a new sweep, filled in.
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
  // Letter by letter: a run whose parameters were changed thousands of times has more than a call takes arguments.
  const raw = Array.from(new TextEncoder().encode(JSON.stringify(body)), (code) => String.fromCharCode(code));
  return btoa(raw.join("")).replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
}

/**
 * Read a fragment. Whether the rest of it is right is for the server to say.
 *
 * @template Body
 * @param {string} fragment
 * @returns {Body}
 * @throws {Error} It holds no experiment.
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
 * @throws {Error} It does not hold JSON.
 */
export function parse(fragment) {
  const raw = atob(fragment.replace(/^#/, "").replaceAll("-", "+").replaceAll("_", "/"));
  return JSON.parse(new TextDecoder().decode(Uint8Array.from(raw, (letter) => letter.charCodeAt(0))));
}
