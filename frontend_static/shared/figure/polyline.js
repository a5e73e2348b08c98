/** Lines through many points: fewer of them where more would fall into one column of pixels, and the nearest to a pointer. */

/** From so many points a column of pixels on, a line is thinned. */
const CROWDED = 4;

/** Half the length of what is drawn of a point that no other one is joined to, px. */
export const ALONE = 0.75;

/**
 * A path through points; what is not a number parts it. A point with nothing known at either side is a short dash.
 *
 * @param {Float64Array} x px
 * @param {Float64Array} y px
 */
export function pathThrough(x, y) {
  const path = new Path2D();
  const points = kept(x, y);
  const isKnown = (/** @type {number|undefined} */ index) => index !== undefined && Number.isFinite(x[index] + y[index]);
  points.forEach((index, place) => {
    if (!isKnown(index)) return;
    const [before, after] = [isKnown(points[place - 1]), isKnown(points[place + 1])];
    if (before) path.lineTo(x[index], y[index]);
    else path.moveTo(after ? x[index] : x[index] - ALONE, y[index]);
    if (!before && !after) path.lineTo(x[index] + ALONE, y[index]);
  });
  return path;
}

/**
 * Numbers of the points that have to be drawn. Of a line that goes to the right through more points than pixels, each
 * column of pixels keeps its first, lowest, highest and last: the picture is the same.
 *
 * @param {Float64Array} x px
 * @param {Float64Array} y px
 * @returns {number[]}
 */
export function kept(x, y) {
  const width = x[x.length - 1] - x[0];
  if (!(x.length > CROWDED * Math.max(1, width)) || !goesRight(x)) return Array.from(x.keys());
  /** @type {number[]} */
  const found = [];
  for (let from = 0; from < x.length; ) {
    let [to, low, high] = [from, from, from];
    while (to + 1 < x.length && Math.floor(x[to + 1]) === Math.floor(x[from]) && Number.isFinite(y[to + 1])) {
      to += 1;
      if (y[to] < y[low]) low = to;
      if (y[to] > y[high]) high = to;
    }
    found.push(...new Set([from, Math.min(low, high), Math.max(low, high), to]));
    from = to + 1;
  }
  return found;
}

/** @param {Float64Array} x */
function goesRight(x) {
  return x.every((value, index) => index === 0 || value >= x[index - 1]);
}

/**
 * The place of a line that is nearest to a pointer.
 *
 * @param {Float64Array} x px
 * @param {Float64Array} y px
 * @param {number} px
 * @param {number} py
 * @returns {{x: number, y: number, distance: number, index: number, share: number}|null} Between point `index` and the
 *     next, as far as `share` says.
 */
export function nearestOn(x, y, px, py) {
  /** @type {{x: number, y: number, distance: number, index: number, share: number}|null} */
  let nearest = null;
  for (let index = 0; index + 1 < x.length; index += 1) {
    const [dx, dy] = [x[index + 1] - x[index], y[index + 1] - y[index]];
    const along = ((px - x[index]) * dx + (py - y[index]) * dy) / (dx * dx + dy * dy || 1);
    const share = Math.min(Math.max(along, 0), 1);
    const [atX, atY] = [x[index] + share * dx, y[index] + share * dy];
    const distance = Math.hypot(atX - px, atY - py);
    if (distance < (nearest?.distance ?? Infinity)) nearest = { x: atX, y: atY, distance, index, share };
  }
  return nearest;
}

/**
 * The point that is nearest to a pointer.
 *
 * @param {Float64Array} x px
 * @param {Float64Array} y px
 * @param {number} px
 * @param {number} py
 * @returns {{x: number, y: number, distance: number, index: number}|null}
 */
export function nearestOf(x, y, px, py) {
  let [found, least] = [-1, Infinity];
  for (let index = 0; index < x.length; index += 1) {
    const squared = (x[index] - px) ** 2 + (y[index] - py) ** 2;
    if (squared < least) [found, least] = [index, squared];
  }
  return found < 0 ? null : { x: x[found], y: y[found], distance: Math.sqrt(least), index: found };
}
