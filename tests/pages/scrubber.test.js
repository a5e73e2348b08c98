/** The rows of the scrubber: those that nothing is known for are not drawn, and leave no hole. */

import assert from "node:assert/strict";
import { test } from "node:test";

import { rowsWithout } from "../../frontend_static/session/scrubber.js";

const HEIGHT = 160;

test("with everything known the rows fill the height without touching", () => {
  const rows = Object.values(rowsWithout([], HEIGHT));
  rows.forEach(([, top, height], place) => assert.ok(top + height <= (rows[place + 1]?.[1] ?? HEIGHT)));
  assert.equal(rows.length, 9);
});

test("names of neighbours are a line of letters apart", () => {
  const middles = Object.values(rowsWithout(["events"], 130)).flatMap(([label, top, height]) => (label === "" ? [] : [top + height / 2]));
  middles.slice(1).forEach((middle, place) => assert.ok(middle - middles[place] >= 12));
});

test("what a method cannot fill is not drawn, and the first curve has its room", () => {
  const [whole, less] = [rowsWithout([], HEIGHT), rowsWithout(["ess", "proposal", "events"], HEIGHT)];
  assert.deepEqual(Object.keys(less), ["flags", "error", "sigma", "loss", "bands", "changes"]);
  assert.equal(less.error?.[2], (whole.error?.[2] ?? 0) + 42);
  assert.deepEqual(less.changes, whole.changes);
});

test("without truth the spread is the first curve", () => {
  const rows = rowsWithout(["error", "events", "bands"], HEIGHT);
  assert.equal(rows.sigma?.[1], 12);
  assert.ok((rows.sigma?.[2] ?? 0) > 24 + 34);
});

test("where not all have room, those go that the plots say as well", () => {
  assert.deepEqual(Object.keys(rowsWithout([], 80)), ["flags", "error", "events", "bands", "changes"]);
  assert.deepEqual(Object.keys(rowsWithout(["events"], 80)), ["flags", "error", "loss", "bands", "changes"]);
  assert.deepEqual(Object.keys(rowsWithout(["events", "loss"], 112)), ["flags", "error", "sigma", "ess", "proposal", "bands", "changes"]);
});
