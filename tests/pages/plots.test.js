/** What the plots of a session are made of: columns that grow with a history, limits, and the frames that are seen. */

import assert from "node:assert/strict";
import test from "node:test";

import { BranchColumns } from "../../frontend_static/session/plots/branch_columns.js";
import { reach } from "../../frontend_static/session/plots/limits.js";
import { clamped, scaled } from "../../frontend_static/session/plots/zoom.js";

/** A store of branches, each with a history of errors. */
function storeOf(histories, active) {
  return {
    known: { branch: active },
    branches: Object.keys(histories).map((id) => ({ id, colour: id })),
    historyOf: (id) => histories[id],
  };
}

function read(history, from) {
  const frame = Array.from({ length: history.length - from }, (_, place) => from + place);
  history.asked.push(from);
  return { frame, error: frame.map((each) => history.errors[each]) };
}

function historyOf(errors, edition = 0) {
  return { errors, edition, asked: [], get length() { return this.errors.length; } };
}

test("of a history that has grown only the new frames are read", () => {
  const history = historyOf([1, 2]);
  const columns = new BranchColumns(read);
  columns.update(storeOf({ a: history }, "a"));
  history.errors.push(7);
  const [{ data }] = columns.update(storeOf({ a: history }, "a"));
  assert.deepEqual(data, { frame: [0, 1, 2], error: [1, 2, 7] });
  assert.deepEqual(history.asked, [0, 2]);
  assert.deepEqual(columns.extent, [1, 7]);
});

test("a history that was replaced is read anew, and what it held no longer counts", () => {
  const columns = new BranchColumns(read);
  columns.update(storeOf({ a: historyOf([9, 9, 9]) }, "a"));
  const [{ data }] = columns.update(storeOf({ a: historyOf([1, 2], 1) }, "a"));
  assert.deepEqual(data.error, [1, 2]);
  assert.equal(columns.most, 2);
});

test("the active branch comes last, and one that is gone no longer counts", () => {
  const columns = new BranchColumns(read);
  const both = { a: historyOf([5]), b: historyOf([1]) };
  assert.deepEqual(columns.update(storeOf(both, "a")).map(({ branch, isActive }) => [branch.id, isActive]), [["b", false], ["a", true]]);
  columns.update(storeOf({ b: both.b }, "b"));
  assert.equal(columns.most, 1);
});

test("limits are rounded up, and values that are not known leave them alone", () => {
  assert.equal(reach(14), 15);
  assert.equal(reach(0.95), 1);
  const columns = new BranchColumns(read);
  columns.update(storeOf({ a: historyOf([NaN, 3]) }, "a"));
  assert.deepEqual(columns.extent, [3, 3]);
});

test("zooming keeps the frame under the pointer, and never leaves the run", () => {
  const [low, high] = scaled([0, 100], 25, 0.5);
  assert.deepEqual([low, high], [12.5, 62.5]);
  assert.deepEqual(clamped([-10, 40], 100), [0, 50]);
  assert.deepEqual(clamped([80, 130], 100), [50, 100]);
  assert.equal(clamped([-10, 200], 100), null);
  const [first, last] = scaled([10, 12], 11, 0.01);
  assert.equal(last - first, 4);
});
