/** What can be turned in a lesson: each control with a way back to where it was, and the seed with a way to a new draw. */

import { DeclaredControl, NumberBox } from "../session/panel/control.js";
import { IconButton } from "../shared/icons.js";
import { h, html, useLayoutEffect, useSignal } from "../vendor/preact.js";

/** @import { Declaration } from "../shared/messages.js" */
/** @import { Value } from "../shared/format.js" */
/** @import { VNode } from "../vendor/preact.js" */
/** @typedef {Record<string, Value>} Values By the names of the parameters, the seed and the tracker among them. */

export const SEED = "seed";

/**
 * What can be turned.
 *
 * @typedef {object} Turnable
 * @property {string} name
 * @property {string} title
 * @property {(value: Value, propose: (value: Value) => void) => VNode} draw
 */

/**
 * The controls of declared parameters, in order.
 *
 * @param {readonly Declaration[]} declarations
 * @param {Values} values In force; a parameter without one has no control.
 * @returns {Turnable[]}
 */
export function declared(declarations, values) {
  const known = declarations.filter(({ name }) => name in values);
  return known.map((each) => ({ name: each.name, title: each.title, draw: (value, propose) => h(DeclaredControl, { declaration: each, value, propose }) }));
}

/**
 * @param {string} hint
 * @returns {Turnable}
 */
export function seedControl(hint) {
  const draw = (/** @type {Value} */ value, /** @type {(value: Value) => void} */ propose) =>
    h(NumberBox, { label: "Seed", hint, min: 0, step: 1, value: Number(value), propose });
  return { name: SEED, title: "Seed", draw };
}

/**
 * @typedef {{
 *   turnables: readonly Turnable[],
 *   values: Values,
 *   isLocked: boolean,
 *   isInert?: boolean,
 *   propose: (name: string, value: Value) => void,
 *   reset: (name: string) => void,
 *   draw?: () => void,
 * }} ControlsProps `values` in force, but for one in somebody's hand; `isLocked` while they wait for an answer, `isInert` while
 *     what they turn is not there; `draw` draws other random numbers.
 */

/**
 * The controls, each with a way back to where it was.
 *
 * @param {ControlsProps} props
 */
export function Controls({ turnables, values, isLocked, isInert = false, propose, reset, draw }) {
  return html`<div class="lesson-controls" data-part="controls" inert=${isInert} hidden=${turnables.length === 0 && !draw}>
    <fieldset class="lesson-fields" aria-label="Controls" disabled=${isLocked}>
      ${turnables.map((turnable) => h(Turned, { key: turnable.name, turnable, value: values[turnable.name], propose, reset }))}
      ${draw && html`<button type="button" title="Other random numbers (D)" data-role="draw" onClick=${draw}>New draw</button>`}
    </fieldset>
  </div>`;
}

/** @param {{turnable: Turnable, value: Value|undefined, propose: (name: string, value: Value) => void, reset: (name: string) => void}} props */
function Turned({ turnable: { name, title, draw }, value, propose, reset }) {
  const shown = useSignal(value ?? "");
  const turn = (/** @type {Value} */ wanted) => {
    shown.value = wanted;
    propose(name, wanted);
  };
  // At once, or a slider that is moved on meanwhile would jump back; also with the value that it has, to which a refused one goes.
  useLayoutEffect(() => {
    if (value !== undefined) shown.value = value;
  });
  return html`<div class="lesson-control" data-control=${name}>
    ${draw(shown.value, turn)} ${h(IconButton, { name: "replay", title: `Reset ${title}`, run: () => reset(name) })}
  </div>`;
}
