/** Pictures of figures, decoded before the figure that shows them is painted, so that none flashes. */

/** @import { Figure } from "./traces.js" */

/** How many are kept: those of the figure that is shown and of some before it. */
const MOST = 16;
/** By their files; the newest last.
 *
 * @type {Map<string, ImageBitmap>} */
const known = new Map();

/** @param {string} png */
export function decoded(png) {
  return known.get(png);
}

/**
 * Decode what a figure shows and is not known yet.
 *
 * @param {Figure} figure
 * @returns {Promise<unknown>|null} Null where there is nothing to wait for.
 */
export function decode({ panels }) {
  const files = panels.flatMap(({ traces }) => traces.flatMap((trace) => (trace.kind === "picture" ? [trace.png] : [])));
  const missing = files.filter((png) => !known.has(png));
  if (!missing.length) return null;
  return Promise.all(missing.map(read)).then(() => forget(files.length));
}

/** @param {string} png In base64. */
async function read(png) {
  const bytes = Uint8Array.from(atob(png), (letter) => letter.charCodeAt(0));
  known.set(png, await createImageBitmap(new Blob([bytes], { type: "image/png" })));
}

/** @param {number} shown */
function forget(shown) {
  for (const [png, bitmap] of [...known].slice(0, Math.max(0, known.size - Math.max(MOST, shown)))) {
    bitmap.close();
    known.delete(png);
  }
}
