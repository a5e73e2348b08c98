import assert from "node:assert/strict";
import { describe, it } from "node:test";

import { decode, Layers } from "../../frontend_static/session/flat/drawing.js";
import { nameAt } from "../../frontend_static/session/flat/flat_view.js";
import { placed } from "../../frontend_static/session/flat/paint.js";

it("a drawing of another version or of another kind is refused in words", () => {
  const headed = (magic, version) => new Uint8Array([...new TextEncoder().encode(magic), version]).buffer;
  assert.throws(() => decode(headed("pfd", 9)), /version 2, the server sends version 9; reload the page/);
  assert.throws(() => decode(headed("gif", 2)), /begins with pfd, got gif/);
});

describe("layers", () => {
  const layer = (name, shown, role = "") => ({ name, title: name, shown, role, legend: [] });

  it("are shown as declared, and those that nobody declared, too", () => {
    const layers = new Layers([layer("a", true), layer("b", false)]);
    assert.deepEqual(["a", "b", "c"].map((name) => layers.isShown(name)), [true, false, true]);
  });

  it("through time are none from the front", () => {
    const layers = new Layers([layer("flat", true, "flat only"), layer("time", true, "through time")]);
    assert.deepEqual([layers.declared.map(({ name }) => name), layers.isShown("time")], [["flat"], false]);
  });
});

it("places on the canvas start at the centre of the first pixel, stay within bounds, and are null for missing numbers", () => {
  const given = [[0, 1], [-0.5, 3], [319.5, 2], [1e9, 1], [-Infinity, 1], [NaN, 1]];
  assert.deepEqual(given.map(([value, scale]) => placed(value, scale)), [0.5, 0, 640, 30_000, -30_000, NaN]);
});

describe("the name of what a pointer is at", () => {
  const text = { kind: "text", layer: "names", position: new Float32Array([0, 0, 2]) };
  const items = [
    { ...text, text: "lmc", title: "left eye, inner corner", point: new Float32Array([100, 50, 2]) },
    { ...text, text: "leye", title: "left eye", point: new Float32Array([104, 50, 2]) },
    { ...text, text: "V1", title: "", point: new Float32Array([200, 50, 2]) },
    { ...text, text: "x", title: "an axis", point: null },
  ];

  for (const [what, cases] of [
    ["is that of the nearest point which has one", [[101, 51, 1, "left eye, inner corner"], [105, 49, 1, "left eye"], [200, 50, 1, ""], [0, 0, 1, ""]]],
    ["reaches as far on the page, however large the picture", [[108, 50, 1, "left eye"], [108, 50, 4, ""], [120, 50, 0.5, "left eye"]]],
  ]) it(what, () => assert.deepEqual(cases.map(([x, y, scale]) => nameAt(items, x, y, scale)), cases.map(([, , , name]) => name)));
});
