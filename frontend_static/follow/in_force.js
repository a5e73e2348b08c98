/** The parameters in force, as a list to be read: first what the lecturer has changed, folded all the rest. */

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
 * @property {string} [was] What it was before it was changed.
 * @property {boolean} isFirst Whether it is among those that count here.
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
  return [
    { title: "Tracker", value: method(tracker), isFirst: "tracker" in before, ...was(before.tracker, tracker, method) },
    { title: "Seed", value: String(recipe.seed), isFirst: false },
    ...turnable(declarations, parameters).filter(isRead).map((declaration) => {
      const { name, title } = declaration;
      const told = (/** @type {Value} */ value) => parameterValue(value, declaration);
      const changed = was(before[name], parameters[name], told);
      return { title, value: told(parameters[name]), isFirst: about.includes(name) || "was" in changed, ...changed };
    }),
  ];
}

/**
 * @param {LessonDetail} lesson
 * @param {Record<string, Value>} parameters
 * @param {number} seed
 * @returns {Entry[]}
 */
export function ofLesson({ declarations, asked, random, seed: first }, parameters, seed) {
  const turned = turnable(declarations, asked).map((declaration) => {
    const { name, title } = declaration;
    const told = (/** @type {Value} */ value) => parameterValue(value, declaration);
    return { title, value: told(parameters[name]), isFirst: true, ...was(asked[name], parameters[name], told) };
  });
  return random ? [...turned, { title: "Seed", value: String(seed), isFirst: true, ...was(first, seed, String) }] : turned;
}

/**
 * @param {readonly Declaration[]} declarations
 * @param {Record<string, Value>} values
 */
function turnable(declarations, values) {
  return declarations.filter(({ name, kind }) => kind !== "colour" && name in values);
}

/**
 * @param {Value|undefined} before
 * @param {Value} now
 * @param {(value: Value) => string} told
 * @returns {{was?: string}}
 */
function was(before, now, told) {
  return before === undefined || before === now ? {} : { was: told(before) };
}
