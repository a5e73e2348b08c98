/** The items of a lecture: pages that a link of this site shows. */

import { request } from "../shared/api.js";
import { damagedOr, savedOf, wantedOf } from "../shared/comparison.js";
import { decode } from "../shared/share_link.js";

/** @import { SessionPublic } from "../shared/messages.js" */

/** @typedef {Record<string, unknown>} Item In the form of a lecture's file. */

/** Items that a lecture names by the same id as their address. */
const BY_NAME = new Map([["learn", "lesson"], ["failures", "failure"]]);

/** The item that makes a session again, up to the shown frame.
 *
 * @param {SessionPublic} session
 * @returns {Item}
 */
export function itemOfSession({ recipe, upload, position, name }) {
  return { session: { recipe, upload, position }, title: name };
}

/** The item for a link, completed by data from this server.
 *
 * @param {string} text
 * @param {string} [base] Address of the server.
 * @returns {Promise<Item>}
 * @throws {Error} If a lecture cannot show the link's page; the message is a sentence.
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
