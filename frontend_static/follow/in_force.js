/** The current parameters as a read-only list: first those that the lecturer has changed; the others are folded. */

import { trackerTitle } from "../session/steering.js";
import { parameterValue } from "../shared/format.js";
import { html } from "../vendor/preact.js";

/** @import { Value } from "../shared/format.js" */
/** @import { Declaration, LessonDetail, SessionPublic } from "../shared/messages.js" */
/** @import { ReadonlySignal } from "../vendor/preact.js" */

/**
 * @typedef {object} Entry
 * @property {string} title
 * @property {string} value
 * @property {string} [was] Value before the change.
 * @property {boolean} isFirst Whether it is listed first.
 */

/** @param {{entries: ReadonlySignal<readonly Entry[]>}} props */
export function InForce({ entries }) {
  const others = entries.value.filter(({ isFirst }) => !isFirst);
  return html`<section class="in-force" aria-label="Parameters in force">
    <h2>Parameters</h2>
    ${list(entries.value.filter(({ isFirst }) => isFirst))}
    ${others.length > 0 && html`<details><summary>${others.length} more, with their initial values</summary>${list(others)}</details>`}
  </section>`;
}

/** @param {readonly Entry[]} entries */
function list(entries) {
  const one = (/** @type {Entry} */ { title, value, was: old }) => html`
    <dt>${title}</dt>
    <dd data-changed=${old === undefined ? null : true}>${value}${old !== undefined && html`<span class="hint"> was ${old}</span>`}</dd>
  `;
  return html`<dl>${entries.map(one)}</dl>`;
}

/**
 * @param {SessionPublic} session
 * @returns {Entry[]}
 */
export function ofSession(session) {
  const { declarations, parameters, timeline, about, tracker, recipe } = session;
  /** @type {Record<string, Value>} */
  const before = Object.assign({}, ...timeline.filter(({ frame }) => frame > 0).map((change) => change.before).reverse());
  const isRead = (/** @type {Declaration} */ { trackers }) => trackers.length === 0 || trackers.includes(tracker);
  const method = (/** @type {Value} */ id) => trackerTitle(session, String(id));
  const known = turnable(declarations, parameters).filter(isRead);
  return [
    entry("Tracker", method, before.tracker, tracker, false),
    entry("Seed", String, undefined, recipe.seed, false),
    ...known.map((it) => entry(it.title, inWords(it), before[it.name], parameters[it.name], about.includes(it.name))),
  ];
}

/**
 * @param {LessonDetail} lesson
 * @param {Record<string, Value>} parameters
 * @param {number} seed
 * @returns {Entry[]}
 */
export function ofLesson({ declarations, asked, random, seed: first }, parameters, seed) {
  const turned = turnable(declarations, asked).map((it) => entry(it.title, inWords(it), asked[it.name], parameters[it.name], true));
  return random ? [...turned, entry("Seed", String, first, seed, true)] : turned;
}

/**
 * @param {readonly Declaration[]} declarations
 * @param {Record<string, Value>} values
 */
function turnable(declarations, values) {
  return declarations.filter(({ name, kind }) => kind !== "colour" && name in values);
}

/**
 * @param {Declaration} declaration
 * @returns {(value: Value) => string}
 */
function inWords(declaration) {
  return (value) => parameterValue(value, declaration);
}

/**
 * @param {string} title
 * @param {(value: Value) => string} told
 * @param {Value|undefined} before
 * @param {Value} now
 * @param {boolean} isFirst Whether it is listed first even if unchanged.
 * @returns {Entry}
 */
function entry(title, told, before, now, isFirst) {
  const isChanged = before !== undefined && before !== now;
  return { title, value: told(now), isFirst: isFirst || isChanged, ...(isChanged && { was: told(before) }) };
}
