/** Words and a meter for work that takes a while. */

import { duration } from "./format.js";
import { html } from "../vendor/preact.js";

/** A rate is a rate only after a while. */
const RATE_AFTER_S = 2;

/**
 * "Computing frame 1,200 of 4,000, about 40 s left".
 *
 * @param {number} frame
 * @param {number} goal
 * @param {number} seconds Since it began.
 * @param {number} frames Computed since then.
 */
export function progressWords(frame, goal, seconds, frames) {
  const place = `Computing frame ${frame.toLocaleString("en")} of ${goal.toLocaleString("en")}`;
  if (seconds < RATE_AFTER_S || frames <= 0) return place;
  return `${place}, about ${duration((seconds * (goal - frame)) / frames)} left`;
}

/** @param {{share: number|null, label: string}} props How far something is; it only moves while the share is not known. */
export function Meter({ share, label }) {
  return html`<progress key=${share === null ? "moving" : "known"} max="1" value=${share ?? undefined} aria-label=${label}></progress>`;
}
