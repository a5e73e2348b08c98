/** The walk through a lecture: the shown item, and the time that each has taken. It belongs to the tab, as a class does, and each opened
 page finds it. A poll has no page: it appears over the page of the item before it, or, if there is none, after it. */

/** @import { LectureItemPublic, LecturePublic } from "../shared/messages.js" */

/** A presented item; times are in milliseconds.
 *
 * @typedef {Pick<LectureItemPublic, "kind"|"title"|"minutes"|"page"|"asks"> & Progress} Step
 */
/**
 * @typedef {object} Progress
 * @property {number} spent Time taken; for the shown step, until it was last opened.
 * @property {boolean} asked Whether the class was asked its question.
 * @property {string|null} opened Address of the session that the step started.
 */

/**
 * @typedef {object} Walk
 * @property {string} lecture
 * @property {string} title
 * @property {Step[]} steps
 * @property {number} at Index of the shown step.
 * @property {number} begun When the walk began.
 * @property {number} since When the shown step was last opened.
 * @property {number|null} ended
 */

const MINUTE_MS = 60_000;

/** Begin a lecture with its first step. Items that cannot be shown here are left out.
 *
 * @param {Pick<LecturePublic, "id"|"title"> & {items: readonly LectureItemPublic[]}} lecture
 * @param {number} now
 * @returns {Walk|null} Null if no item has a page.
 */
export function begin({ id, title, items }, now) {
  const steps = items
    .filter(({ problem, page, asks }) => problem === null && (page !== null || asks !== null))
    .map(({ kind, title: name, minutes, page, asks }) => ({ kind, title: name, minutes, page, asks, spent: 0, asked: false, opened: null }));
  if (steps.every(({ page }) => page === null)) return null;
  return { lecture: id, title, steps, at: 0, begun: now, since: now, ended: null };
}

/** The step whose page is shown during a step.
 *
 * @param {Walk} walk
 * @param {number} [at]
 */
export function hostOf({ steps, at: shown }, at = shown) {
  const before = steps.slice(0, at + 1).findLastIndex(({ page }) => page !== null);
  return before >= 0 ? before : steps.findIndex(({ page }) => page !== null);
}

/** The address of the page for the present step.
 *
 * @param {Walk} walk
 * @returns {string}
 */
export function pageOf(walk) {
  const { opened: begun, page } = walk.steps[hostOf(walk)];
  return begun ?? page ?? "";
}

/**
 * Go to another step.
 *
 * @param {Walk} walk
 * @param {number} by
 * @param {number} now
 * @returns {Walk}
 */
export function go(walk, by, now) {
  const at = Math.max(0, Math.min(walk.steps.length - 1, walk.at + by));
  return { ...changed(walk, walk.at, { spent: spentOn(walk, walk.at, now) }), at, since: now };
}

/** The walk with its end.
 *
 * @param {Walk} walk
 * @param {number} now
 * @returns {Walk}
 */
export function endWalk(walk, now) {
  return { ...go(walk, 0, now), ended: now };
}

/** The walk with the present step marked as asked.
 *
 * @param {Walk} walk
 */
export function markAsked(walk) {
  return changed(walk, walk.at, { asked: true });
}

/** The walk with the address of the session that the step started.
 *
 * @param {Walk} walk
 * @param {string|null} address
 */
export function opened(walk, address) {
  return changed(walk, hostOf(walk), { opened: address });
}

/**
 * How long a step has taken.
 *
 * @param {Walk} walk
 * @param {number} at
 * @param {number} now
 */
export function spentOn(walk, at, now) {
  const isShown = walk.at === at && walk.ended === null;
  return walk.steps[at].spent + (isShown ? Math.max(0, now - walk.since) : 0);
}

/** The clock: taken and planned times of the whole lecture and of the shown step.
 *
 * @param {Walk} walk
 * @param {number} now
 */
export function clock(walk, now) {
  const planned = walk.steps.reduce((sum, { minutes }) => sum + minutes, 0);
  return {
    whole: { taken: Math.max(0, (walk.ended ?? now) - walk.begun), planned: MINUTE_MS * planned },
    step: { taken: spentOn(walk, walk.at, now), planned: MINUTE_MS * walk.steps[walk.at].minutes },
  };
}

/**
 * "4:05", "1:04:05".
 *
 * @param {number} milliseconds
 */
export function time(milliseconds) {
  const seconds = Math.floor(milliseconds / 1000);
  const [hours, minutes, rest] = [Math.floor(seconds / 3600), Math.floor(seconds / 60) % 60, seconds % 60];
  const two = (/** @type {number} */ value) => String(value).padStart(2, "0");
  return hours > 0 ? `${hours}:${two(minutes)}:${two(rest)}` : `${minutes}:${two(rest)}`;
}

/** "4:05 of 8 min", and the overrun.
 *
 * @param {{taken: number, planned: number}} clocked
 */
export function clockWords({ taken, planned }) {
  const over = taken > planned ? `, ${time(taken - planned)} over` : "";
  return `${time(taken)} of ${minutesText(planned / MINUTE_MS)}${over}`;
}

/**
 * "45 min", "1 h 15 min".
 *
 * @param {number} minutes
 */
export function minutesText(minutes) {
  const whole = Math.round(10 * minutes) / 10;
  const hours = Math.floor(whole / 60);
  const rest = Math.round(10 * (whole - 60 * hours)) / 10;
  if (hours === 0) return `${rest} min`;
  return rest === 0 ? `${hours} h` : `${hours} h ${rest} min`;
}

/**
 * @param {Walk} walk
 * @param {number} at
 * @param {Partial<Progress>} progress
 * @returns {Walk}
 */
function changed(walk, at, progress) {
  return { ...walk, steps: walk.steps.map((step, place) => (place === at ? { ...step, ...progress } : step)) };
}
