/**
 * Flat views that lie over each other, each in one colour: the lowest has the picture and what is truly there, the others
 * only what their trackers believe.
 */

import { signal } from "../../vendor/preact.js";

/** @import { Colour, Primitive } from "./decode.js" */

/** @typedef {{tint: Colour, isLowest: boolean}} Coat What becomes of a view that is one of several. */

/** What is truly there is drawn in it, here as in the film. */
const TRUTH = "0,0,0";

export class Overlay {
  /** Null for a view by itself. */
  coat = signal(/** @type {Coat|null} */ (null));

  /** @param {number} first The frame of the run that is frame 0 of all: a caption counts as all do. */
  constructor(first) {
    this.first = first;
  }
}

/**
 * What is painted of a primitive in a view that is one of several; nothing for what the lowest one shows for all.
 *
 * @param {Primitive} item
 * @param {Coat} coat
 * @returns {Primitive|null}
 */
export function coated(item, { tint, isLowest }) {
  if (item.kind === "picture") return isLowest ? item : null;
  if ("colours" in item) return { ...item, colours: filled(item.colours.length, tint) };
  if (!("colour" in item) || item.colour instanceof Uint8Array) return item;
  if (String(item.colour) === TRUTH) return isLowest ? item : null;
  return { ...item, colour: tint };
}

/**
 * @param {number} length
 * @param {Colour} colour
 */
function filled(length, colour) {
  const colours = new Uint8Array(length);
  for (let at = 0; at < length; at += 1) colours[at] = colour[at % 3];
  return colours;
}
