/** The two runs of a failure in step, from the frame before it happens. */

import { h } from "../shared/dom.js";
import { value, withUnit } from "./difference_text.js";
import { JointView } from "../compare/joint_view.js";

/** @import { Told } from "../compare/compare.js" */
/** @import { FailurePublic } from "../shared/messages.js" */
/** @import { Column } from "./column.js" */

/**
 * @param {readonly Column[]} columns
 * @param {HTMLElement} deck Gets the transport and the scrubber.
 * @param {FailurePublic} failure
 */
export function pair(columns, deck, failure) {
  const { frame } = failure;
  const members = columns.map(({ place, side, name, colour }) => ({ place, name, colour, first: 0, recipe: { recipe: failure[side], position: frame } }));
  const together = new JointView(members);
  const before = h("button", { type: "button", on: { click: () => together.steering.seek(frame) } }, `Frame ${frame}, before it happens`);
  together.deck(deck, [before]);
  together.store.know({ beforeLoss: frame, notes: [{ frame, note: "before it happens" }] });
  together.listen({});
  return together;
}

/**
 * What a class is told of the two: a comparison, whose settings are what the cure changes.
 *
 * @param {readonly Column[]} columns
 * @param {FailurePublic} failure
 * @returns {Told}
 */
export function told(columns, { differences }) {
  const runs = columns.map(({ name, setting, colour }) => ({ name, title: `${name}, ${setting}`, colour, first: 0 }));
  const settings = differences.map((each) => ({
    name: each.title,
    title: each.title,
    values: columns.map(({ side }) => withUnit(value(each[side]), each.unit)),
  }));
  return { outline: { unit: "", settings, runs }, outcome: null, arrangement: "side" };
}
