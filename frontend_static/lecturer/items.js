/** What can be an item of a lecture: what a link of this site shows. */

import { request } from "../shared/api.js";
import { damagedOr, savedOf, wantedOf } from "../shared/comparison.js";
import { decode } from "../shared/share_link.js";

/** @import { SessionPublic } from "../shared/messages.js" */

/** @typedef {Record<string, unknown>} Item As a lecture's file has it. */

/** Items that a lecture names as their addresses do. */
const BY_NAME = new Map([["learn", "lesson"], ["failures", "failure"]]);

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
 * @param {string} [base] Address of the server.
 * @returns {Promise<Item>}
 * @throws {Error} A sentence: a lecture cannot show what the link leads to.
 */
export async function itemOfAddress(text, base = document.baseURI) {
  if (!URL.canParse(text.trim(), base)) throw new Error("This is not a link.");
  const address = new URL(text.trim(), base);
  const [kind, name = ""] = damagedOr(() => address.pathname.split("/").slice(-2).map(decodeURIComponent));
  if (name === "compare") {
    const saved = savedOf(address);
    const wanted = wantedOf(address);
    if (saved !== null) {
      const { runs, position, arrangement, title } = await request("GET comparisons/saved/{saved}", { saved });
      return { comparison: { runs, position, arrangement }, title };
    }
    if (wanted !== null) return { comparison: wanted };
  }
  if (kind === "session" && name === "new" && address.hash.length > 1) {
    const { recipe, upload, position } = damagedOr(() => decode(address.hash));
    return { session: { recipe, ...(upload && { upload }), ...(position && { position }) } };
  }
  if (kind === "session" && name !== "new" && name !== "") return itemOfSession(await request("GET sessions/{session}", { session: name }));
  const own = BY_NAME.get(kind);
  if (own !== undefined && name !== "") return { [own]: name };
  throw new Error("This link leads to something that a lecture cannot show. Copy the link of a lesson, a failure, a session or a comparison.");
}
