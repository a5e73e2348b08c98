/** Limits of axes: rounded, so that they change seldom and nothing jumps. */

const STEPS = [1, 1.5, 2, 3, 4, 5, 7.5, 10];

/**
 * From 0 to beyond a value.
 *
 * @param {number} most
 */
export function reach(most) {
  const value = most * 1.05;
  const power = 10 ** Math.floor(Math.log10(value));
  return power * (STEPS.find((step) => step * power >= value) ?? value / power);
}

/**
 * Around values that may lie far from 0.
 *
 * @param {[number, number]} extent The smallest and the largest value.
 * @param {number} smallest How far they are apart at least.
 * @returns {[low: number, high: number]}
 */
export function enclose([low, high], smallest) {
  if (low > high) return [0, smallest];
  const span = Math.max(high - low, smallest);
  const step = 10 ** Math.floor(Math.log10(span / 2));
  const start = Math.floor(low / step) * step;
  return [start, Math.max(Math.ceil(high / step) * step, start + smallest)];
}
