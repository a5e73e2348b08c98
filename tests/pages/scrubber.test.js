/** The rows of the scrubber: those that nothing is known for are not drawn, and leave no hole. */

import assert from "node:assert/strict";
import { test } from "node:test";

import { placed } from "../../frontend_static/session/scrubber.js";

const HEIGHT = 96;
const ALL = ["flags", "error", "events", "loss", "bands", "changes"];
const NO_TRUTH = ["flags", "sigma", "loss", "bands", "changes"];

test("names of neighbours are a line of letters apart", () => {
  const middles = Object.values(placed(ALL, HEIGHT)).flatMap(([label, top, height]) => (label === "" ? [] : [top + height / 2]));
  middles.slice(1).forEach((middle, place) => assert.ok(middle - middles[place] >= 12));
});

test("what a method cannot fill is not drawn, and the curve has its room", () => {
  const [whole, less] = [placed(ALL, HEIGHT), placed(NO_TRUTH, HEIGHT)];
  assert.deepEqual(Object.keys(less), NO_TRUTH);
  assert.equal(less.sigma?.[2], (whole.error?.[2] ?? 0) + 18);
  assert.deepEqual(less.changes, whole.changes);
});
