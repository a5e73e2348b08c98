import assert from "node:assert/strict";
import { describe, it } from "node:test";

import { decode, Layers } from "../../frontend_static/session/flat/drawing.js";
import { nameAt } from "../../frontend_static/session/flat/flat_view.js";
import { placed } from "../../frontend_static/session/flat/paint.js";
import { css } from "../../frontend_static/shared/theme.js";
import { follow } from "../../frontend_static/shared/timing.js";

const HEAD = { frame: 7, width: 320, height: 240, caption: "frame 7 · σ 2 px" };

/** A message as `server/pftrack_server/sessions/worker/codec.py` describes it. */
function message(primitives, { arrays = [], pictures = [], version = 2, magic = "pfd", worlds = [] } = {}) {
  const body = new Uint8Array(arrays.flatMap((array) => [...new Uint8Array(array.buffer)]));
  let text = JSON.stringify({ ...HEAD, arrays: body.length, primitives, worlds });
  let bytes = new TextEncoder().encode(text);
  while (bytes.length % 4) bytes = new TextEncoder().encode((text += " "));
  const start = new Uint8Array(8);
  start.set(new TextEncoder().encode(magic));
  start[3] = version;
  new DataView(start.buffer).setUint32(4, bytes.length, true);
  const records = pictures.flatMap(({ key, file }) => {
    const record = new Uint8Array(8 + Math.ceil(file.length / 4) * 4);
    new DataView(record.buffer).setUint32(0, key, true);
    new DataView(record.buffer).setUint32(4, file.length, true);
    record.set(file, 8);
    return [...record];
  });
  return new Uint8Array([...start, ...bytes, ...body, ...records]).buffer;
}

describe("a drawing's message", () => {
  it("holds frame, size and caption", () => {
    const { frame, width, height, caption, primitives, files } = decode(message([]));
    assert.deepEqual({ frame, width, height, caption }, HEAD);
    assert.deepEqual(primitives, []);
    assert.equal(files.size, 0);
  });

  it("is read without copying: arrays are views of it, of their kinds", () => {
    const positions = new Float32Array([1.5, 2.5, 0, NaN, -4, 9]);
    const colours = new Uint8Array([1, 2, 3, 4, 5, 6, 0, 0]);
    const item = {
      name: "cloud",
      kind: "points",
      layer: "particles",
      size: 2,
      positions: { type: "f4", at: 0, shape: [2, 3] },
      colours: { type: "u1", at: 24, shape: [2, 3] },
    };
    const buffer = message([item], { arrays: [positions, colours] });
    const [cloud] = decode(buffer).primitives;
    assert.equal(cloud.positions.buffer, buffer);
    assert.deepEqual([...cloud.positions], [...positions]);
    assert.deepEqual([...cloud.colours], [1, 2, 3, 4, 5, 6]);
    assert.equal(cloud.layer, "particles");
  });

  it("keeps a colour and a picture's key as they are", () => {
    const line = { name: "line", kind: "polyline", layer: "trail", colour: [1, 2, 3], width: 2, positions: { type: "f4", at: 0, shape: [0, 3] } };
    const picture = { name: "picture", kind: "picture", layer: "picture", image_rgb: { key: 4, shape: [240, 320, 3] } };
    const { primitives } = decode(message([picture, line]));
    assert.deepEqual(primitives[0], picture);
    assert.deepEqual(primitives[1].colour, [1, 2, 3]);
    assert.equal(primitives[1].positions.length, 0);
  });

  it("carries any number of files behind the arrays", () => {
    const pictures = [
      { key: 3, file: [1, 2, 3, 4, 5] },
      { key: 9, file: [6, 7] },
    ];
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
    assert.deepEqual(layers.declared.map(({ name }) => name), ["flat"]);
    assert.equal(layers.isShown("time"), false);
  });

  it("are followed, each change once, until the end", () => {
    const layers = new Layers([layer("a", true)]);
    const end = new AbortController();
    const seen = [];
    follow(() => layers.isShown("a"), () => seen.push(layers.isShown("a")), end.signal);
    layers.set("a", false);
    layers.set("a", false);
    assert.deepEqual(seen, [true, false]);
    end.abort();
    layers.set("a", true);
    assert.deepEqual(seen, [true, false]);
  });
});

describe("places on the canvas", () => {
  it("count from the centre of the first pixel", () => {
    assert.equal(placed(0, 1), 0.5);
    assert.equal(placed(-0.5, 3), 0);
    assert.equal(placed(319.5, 2), 640);
  });

  it("end far outside, and are none where there is no number", () => {
    assert.equal(placed(1e9, 1), 30_000);
    assert.equal(placed(-Infinity, 1), -30_000);
    assert.ok(Number.isNaN(placed(NaN, 1)));
  });

  it("have colours as style sheets write them", () => {
    assert.equal(css([0, 114, 178]), "rgb(0 114 178)");
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

  it("is that of the nearest point which has one", () => {
    assert.equal(nameAt(items, 101, 51, 1), "left eye, inner corner");
    assert.equal(nameAt(items, 105, 49, 1), "left eye");
    assert.equal(nameAt(items, 200, 50, 1), "");
    assert.equal(nameAt(items, 0, 0, 1), "");
  });

  it("reaches as far on the page, however large the picture is shown", () => {
    assert.equal(nameAt(items, 108, 50, 1), "left eye");
    assert.equal(nameAt(items, 108, 50, 4), "");
    assert.equal(nameAt(items, 120, 50, 0.5), "left eye");
  });
});
