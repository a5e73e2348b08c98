/** The two runs of a failure in step, from the frame before it happens. */

import { h } from "../shared/dom.js";
import { tokens } from "../shared/theme.js";
import { JointView } from "../compare/joint_view.js";

/** @import { FailurePublic } from "../shared/messages.js" */
/** @import { Column } from "./column.js" */

/** As in the gallery's curves. */
const COLOURS = /** @type {const} */ ({ failing: "lost", cured: "second" });

/**
 * @param {readonly Column[]} columns
 * @param {HTMLElement} deck Gets the transport and the scrubber.
 * @param {FailurePublic} failure
 */
export function pair(columns, deck, failure) {
  const { frame } = failure;
  const members = columns.map(({ place, side, name }) => {
    const colour = tokens(COLOURS[side])[COLOURS[side]];
    return { place, name, colour, first: 0, recipe: { recipe: failure[side], position: frame } };
  });
  const together = new JointView(members);
  const before = h("button", { type: "button", on: { click: () => together.steering.seek(frame) } }, `Frame ${frame}, before it happens`);
  together.deck(deck, [before]);
  together.store.know({ beforeLoss: frame, notes: [{ frame, note: "before it happens" }] });
  together.listen({});
  return together;
}
