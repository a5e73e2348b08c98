/** What of a sweep is shown, and how an address names it, so that a link shows the same. */

/**
 * Axes and methods that are not in the sweep are replaced by those that are.
 *
 * @typedef {object} View
 * @property {"success"|"error"|"measure"|"difference"|"significance"} show
 * @property {string} of Name of the measure that is shown.
 * @property {string} measure What two methods are compared by: "success", "error", or a measure by its name.
 * @property {string} x Name of the axis across.
 * @property {string} y Name of the axis up.
 * @property {string} first
 * @property {string} second
 * @property {number} level
 * @property {"none"|"holm"} correction
 * @property {"chi-square"|"fisher"} test
 */

/**
 * Where an address does not say otherwise; axes and methods are then the first ones of the sweep.
 *
 * @type {View}
 */
const USUAL = { show: "success", of: "", measure: "success", x: "", y: "", first: "", second: "", level: 0.01, correction: "none", test: "chi-square" };

/**
 * @param {URLSearchParams} query
 * @returns {View}
 */
export function viewOf(query) {
  /**
   * @template {string} Value
   * @param {string} name
   * @param {readonly Value[]} values The usual one first.
   */
  const among = (name, values) => values.find((value) => value === query.get(name)) ?? values[0];
  return {
    show: among("show", ["success", "error", "measure", "difference", "significance"]),
    of: query.get("of") ?? USUAL.of,
    measure: query.get("measure") || USUAL.measure,
    x: query.get("x") ?? USUAL.x,
    y: query.get("y") ?? USUAL.y,
    first: query.get("first") ?? USUAL.first,
    second: query.get("second") ?? USUAL.second,
    level: Number(query.get("level")) || USUAL.level,
    correction: among("correction", ["none", "holm"]),
    test: among("test", ["chi-square", "fisher"]),
  };
}

/** @param {View} view */
export function queryOf(view) {
  const query = new URLSearchParams();
  for (const name of /** @type {(keyof View)[]} */ (Object.keys(USUAL))) {
    if (view[name] !== USUAL[name]) query.set(name, String(view[name]));
  }
  return query;
}
