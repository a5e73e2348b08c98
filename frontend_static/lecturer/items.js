/** What can be an item of a lecture: what a link of this site shows. */

import { request } from "../shared/api.js";
import { savedOf, wantedOf } from "../shared/comparison.js";
import { decode } from "../shared/share_link.js";

/** @import { SessionPublic } from "../shared/messages.js" */

/** @typedef {Record<string, unknown>} Item As a lecture's file has it. */
/** @typedef {{item: Item}|{session: string}|{saved: string}} Linked What is linked; a session or saved comparison of this server by its id. */

/**
 * What makes a session again, up to the frame that is shown.
 *
 * @param {SessionPublic} session
 * @returns {Item}
 */
export function itemOfSession({ recipe, upload, position, name }) {
  return { session: { recipe, upload, position }, title: name };
}

/**
 * The item that a link is, once this server has told what it does not hold itself.
 *
 * @param {string} text
 * @returns {Promise<Item>}
 */
export async function itemOfAddress(text) {
  const found = itemOfLink(text, document.baseURI);
  if ("item" in found) return found.item;
  if ("session" in found) return itemOfSession(await request("GET sessions/{session}", { session: found.session }));
  const { runs, position, arrangement, title } = await request("GET comparisons/saved/{saved}", { saved: found.saved });
  return { comparison: { runs, position, arrangement }, title };
}

/**
 * @param {string} text
 * @param {string} base Address of the server.
 * @returns {Linked}
 * @throws {Error} A sentence: a lecture cannot show what the link leads to.
 */
export function itemOfLink(text, base) {
  const { pathname, search, hash } = parsed(text, base);
  const [kind, name = ""] = pathname.split("/").slice(-2);
  if (name === "compare") {
    const saved = savedOf({ search, hash });
    if (saved !== null) return { saved };
    const wanted = wantedOf({ search, hash });
    if (wanted !== null) return { item: { comparison: wanted } };
  }
  if (kind === "session" && name === "new" && hash.length > 1) return { item: { session: sessionOf(hash) } };
  if (kind === "session" && name !== "new" && name !== "") return { session: decodeURIComponent(name) };
  if (kind === "learn" && name !== "") return { item: { lesson: decodeURIComponent(name) } };
  if (kind === "failures" && name !== "") return { item: { failure: decodeURIComponent(name) } };
  throw new Error("This link leads to something that a lecture cannot show. Copy the link of a lesson, a failure, a session or a comparison.");
}

/** @param {string} hash */
function sessionOf(hash) {
  try {
    const { recipe, upload, position } = decode(hash);
    return { recipe, ...(upload && { upload }), ...(position && { position }) };
  } catch {
    throw new Error("The link is damaged: a part of it is missing after the # sign, or was changed. Copy the whole link again.");
  }
}

/**
 * @param {string} text
 * @param {string} base
 */
function parsed(text, base) {
  try {
    return new URL(text.trim(), base);
  } catch {
    throw new Error("This is not a link.");
  }
}
