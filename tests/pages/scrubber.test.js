/** The rows of the scrubber: those that nothing is known for are not drawn, and leave no hole. */

import assert from "node:assert/strict";
import { test } from "node:test";

import { HEIGHT, rowsWithout } from "../../frontend_static/session/scrubber/rows.js";

test("with everything known the rows fill the height without touching", () => {
  const rows = Object.values(rowsWithout([]));
  rows.forEach(([, top, height], place) => assert.ok(top + height <= (rows[place + 1]?.[1] ?? HEIGHT)));
  assert.equal(rows.length, 8);
});

test("what a method cannot fill is not drawn, and the first curve has its room", () => {
  const [whole, less] = [rowsWithout([]), rowsWithout(["ess", "proposal", "events"])];
  assert.deepEqual(Object.keys(less), ["flags", "error", "sigma", "bands", "changes"]);
  assert.equal(less.error?.[2], (whole.error?.[2] ?? 0) + 40);
  assert.deepEqual(less.changes, whole.changes);
});

test("without truth the spread is the first curve", () => {
  const rows = rowsWithout(["error", "events", "bands"]);
  assert.equal(rows.sigma?.[1], 12);
  assert.ok((rows.sigma?.[2] ?? 0) > 24 + 34);
});
