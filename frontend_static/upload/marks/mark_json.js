/**
 * Where the parts of a mark stand in its JSON: a path of names joined by dots, a number being a place in a list. Editors of
 * kinds that nobody here knows read and write marks by these paths alone.
 */

/** @typedef {import("../../shared/messages.js").Editor} Description */

/**
 * What stands at a path; undefined where nothing does.
 *
 * @param {any} mark
 * @param {string} path
 */
export function valueAt(mark, path) {
  return path.split(".").reduce((value, name) => value?.[name], mark);
}

/**
 * A mark of a kind, from the values at its paths.
 *
 * @param {string} kind
 * @param {Iterable<[string, unknown]>} values
 * @returns {Record<string, any>}
 */
export function markOf(kind, values) {
  /** @type {Record<string, any>} */
  const mark = { kind };
  for (const [path, value] of values) {
    const names = path.split(".");
    /** @type {any} */
    let place = mark;
    names.slice(0, -1).forEach((name, index) => {
      place[name] ??= /^\d+$/.test(names[index + 1]) ? [] : {};
      place = place[name];
    });
    place[names[names.length - 1]] = value;
  }
  return mark;
}

/**
 * The lines of a mark: those that its kind declares, and the one that closes its outline.
 *
 * @param {Description} description
 * @returns {[string, string][]}
 */
export function linesOf({ handles, links, closed }) {
  const first = handles.at(0);
  const last = handles.at(-1);
  if (!closed || first === undefined || last === undefined || handles.length < 3) return links;
  return [...links, [last.name, first.name]];
}
