import assert from "node:assert/strict";
import { describe, it } from "node:test";

import { decode, Layers } from "../../frontend_static/session/flat/drawing.js";
import { nameAt } from "../../frontend_static/session/flat/flat_view.js";
import { placed } from "../../frontend_static/session/flat/paint.js";
import { follow } from "../../frontend_static/shared/timing.js";

const HEAD = { frame: 7, width: 320, height: 240, caption: "frame 7 · σ 2 px" };

/** A message as `server/pftrack_server/sessions/worker/codec.py` describes it. */
function message(primitives, { arrays = [], pictures = [], version = 2, magic = "pfd", worlds = [] } = {}) {
  const filled = (bytes, value) => [...bytes, ...Array(-bytes.length & 3).fill(value)];
  const u32 = (...numbers) => new Uint8Array(new Uint32Array(numbers).buffer);
  const body = arrays.flatMap((array) => [...new Uint8Array(array.buffer)]);
  const head = filled(new TextEncoder().encode(JSON.stringify({ ...HEAD, arrays: body.length, primitives, worlds })), 32);
  const records = pictures.flatMap(({ key, file }) => [...u32(key, file.length), ...filled(file, 0)]);
  return new Uint8Array([...new TextEncoder().encode(magic), version, ...u32(head.length), ...head, ...body, ...records]).buffer;
}

describe("a drawing's message", () => {
  it("holds frame, size and caption", () => {
    const { frame, width, height, caption, primitives, files } = decode(message([]));
    assert.deepEqual([{ frame, width, height, caption }, primitives, files.size], [HEAD, [], 0]);
  });

  it("is read without copying: arrays are views of it, of their kinds", () => {
    const positions = new Float32Array([1.5, 2.5, 0, NaN, -4, 9]);
    const colours = new Uint8Array([1, 2, 3, 4, 5, 6, 0, 0]);
    const parts = { positions: { type: "f4", at: 0, shape: [2, 3] }, colours: { type: "u1", at: 24, shape: [2, 3] } };
    const item = { name: "cloud", kind: "points", layer: "particles", size: 2, ...parts };
    const buffer = message([item], { arrays: [positions, colours] });
    const [cloud] = decode(buffer).primitives;
    assert.equal(cloud.positions.buffer, buffer);
    assert.deepEqual([[...cloud.positions], [...cloud.colours], cloud.layer], [[...positions], [1, 2, 3, 4, 5, 6], "particles"]);
  });

  it("keeps a colour and a picture's key as they are", () => {
    const line = { name: "line", kind: "polyline", layer: "trail", colour: [1, 2, 3], width: 2, positions: { type: "f4", at: 0, shape: [0, 3] } };
    const picture = { name: "picture", kind: "picture", layer: "picture", image_rgb: { key: 4, shape: [240, 320, 3] } };
    const [found, { colour, positions }] = decode(message([picture, line])).primitives;
    assert.deepEqual([found, colour, positions.length], [picture, [1, 2, 3], 0]);
  });

  it("carries any number of files behind the arrays", () => {
    const pictures = [{ key: 3, file: [1, 2, 3, 4, 5] }, { key: 9, file: [6, 7] }];
    const { files } = decode(message([], { arrays: [new Float32Array([1])], pictures }));
    assert.deepEqual([...files].map(([key, file]) => ({ key, file: [...file] })), pictures);
  });

  it("of another version, or none of ours, is refused in words", () => {
    assert.throws(() => decode(message([], { version: 9 })), /version 2, the server sends version 9; reload the page/);
    assert.throws(() => decode(message([], { magic: "gif" })), /begins with pfd, got gif/);
  });
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

  it("are followed, each change once, until the end", () => {
    const [layers, end, seen] = [new Layers([layer("a", true)]), new AbortController(), []];
    follow(() => layers.isShown("a"), () => seen.push(layers.isShown("a")), end.signal);
    for (const isShown of [false, false]) layers.set("a", isShown);
    assert.deepEqual(seen, [true, false]);
    end.abort();
    layers.set("a", true);
    assert.deepEqual(seen, [true, false]);
  });
});

describe("places on the canvas", () => {
  it("count from the centre of the first pixel, end far outside, and are none where there is no number", () => {
    const given = [[0, 1], [-0.5, 3], [319.5, 2], [1e9, 1], [-Infinity, 1], [NaN, 1]];
    assert.deepEqual(given.map(([value, scale]) => placed(value, scale)), [0.5, 0, 640, 30_000, -30_000, NaN]);
  });
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
  ]) {
    it(what, () => assert.deepEqual(cases.map(([x, y, scale]) => nameAt(items, x, y, scale)), cases.map(([, , , name]) => name)));
  }
});
