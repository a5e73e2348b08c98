/** What a person looks for among the things of one's own, as it stands in the page's address. */

/** @typedef {"sessions"|"runs"|"comparisons"|"sweeps"|"uploads"} Kind */

/** @typedef {{words: string, show: Kind|null, limit: number}} Query What has to occur, of which kind alone, and how many. */

/** @type {readonly Kind[]} */
export const KINDS = ["sessions", "runs", "comparisons", "sweeps", "uploads"];

/** So many of each kind where all are listed, and so many more at a time where one kind is. */
export const FEW = 6;
export const MANY = 50;

/**
 * @param {URLSearchParams} address
 * @returns {Query}
 */
export function parseQuery(address) {
  const show = KINDS.find((kind) => kind === address.get("show")) ?? null;
  return { words: address.get("q") ?? "", show, limit: show === null ? FEW : MANY };
}

/**
 * @param {Query} wish
 * @returns {string} A page's address that says the same.
 */
export function addressOf({ words, show }) {
  const address = new URLSearchParams();
  if (show !== null) address.set("show", show);
  if (words.trim() !== "") address.set("q", words.trim());
  return address.size > 0 ? `work?${address}` : "work";
}
