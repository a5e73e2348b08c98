import assert from "node:assert/strict";
import { test } from "node:test";

import { readTable, tableText } from "../../frontend_static/session/truth_table.js";

test("a table is read and written, in the order of frames", () => {
  const text = "frame,x,y,w,h\n4,10,20.5,5,3\n12,-1,0,5,3\n";
  const rows = readTable(text);
  assert.deepEqual(rows.get(4), [10, 20.5, 5, 3]);
  assert.equal(tableText(["frame", "x", "y", "w", "h"], new Map([...rows].reverse())), text);
});
