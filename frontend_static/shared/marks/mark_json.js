/** Paths of a mark's parts in its JSON: names joined by dots; a number is an index in a list. The editor of unknown kinds reads and writes
 marks only by these paths. */

/** @typedef {import("../messages.js").Editor} Description */
/** @typedef {Record<string, unknown>} Mark A mark as the server has it. */

/** The value at a path; undefined if there is none.
 *
 * @param {Mark|null} mark
 * @param {string} path
 */
export function valueAt(mark, path) {
  /** @type {unknown} */
  let value = mark;
  for (const name of path.split(".")) value = isContainer(value) ? value[name] : undefined;
  return value;
}

/**
 * A mark of a kind, from the values at its paths.
 *
 * @param {string} kind
 * @param {Iterable<[string, unknown]>} values
 */
export function markOf(kind, values) {
  /** @type {Mark} */
  const mark = { kind };
  for (const [path, value] of values) put(mark, path.split("."), value);
  return mark;
}

/**
 * @param {Record<string, unknown>} container
 * @param {string[]} path
 * @param {unknown} value
 */
function put(container, [name, ...rest], value) {
  if (rest.length === 0) {
    container[name] = value;
    return;
  }
  const inner = container[name] ?? (/^\d+$/.test(rest[0]) ? [] : {});
  container[name] = inner;
  if (isContainer(inner)) put(inner, rest, value);
}

/**
 * Whether something has parts; those of a list are named by their numbers.
 *
 * @param {unknown} value
 * @returns {value is Record<string, unknown>}
 */
function isContainer(value) {
  return typeof value === "object" && value !== null;
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
