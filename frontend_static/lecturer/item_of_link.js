/** The item of a lecture that a link of this site is. */

import { wantedOf } from "../shared/comparison_link.js";
import { decode } from "../shared/share_link.js";

/** @typedef {{item: Record<string, unknown>}|{session: string}} Linked What is linked; a session that runs here is known by its name. */

/**
 * @param {string} text
 * @param {string} base Address of the server.
 * @returns {Linked}
 * @throws {Error} It is no link of something that a lecture shows; a sentence.
 */
export function itemOfLink(text, base) {
  const { pathname, search, hash } = parsed(text, base);
  const [kind, name = ""] = pathname.split("/").slice(-2);
  if (name === "compare") {
    const wanted = wantedOf({ search, hash });
    if (wanted !== null) return { item: { comparison: wanted } };
  }
  if (kind === "session" && name === "new" && hash.length > 1) return { item: { session: sessionOf(hash) } };
  if (kind === "session" && name !== "new" && name !== "") return { session: decodeURIComponent(name) };
  if (kind === "learn" && name !== "") return { item: { lesson: decodeURIComponent(name) } };
  if (kind === "failures" && name !== "") return { item: { failure: decodeURIComponent(name) } };
  throw new Error("This is no link of a lesson, a failure, a session or a comparison. Copy it from Share, or from the line of addresses.");
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
    throw new Error("This is no link.");
  }
}
