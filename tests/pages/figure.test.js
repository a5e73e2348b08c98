import assert from "node:assert/strict";
import { describe, it } from "node:test";

import {
  even, furniture, margins, named, Scale, ticksOf, titled, valueOn, withRoom, written,
} from "../../frontend_static/shared/figure/axes.js";
import { boundsOf } from "../../frontend_static/shared/figure/handle.js";
import { KINDS, nearestOf, nearestOn } from "../../frontend_static/shared/figure/kinds.js";
import { kept, pathThrough } from "../../frontend_static/shared/figure/paint.js";

const AXIS = { title: "position", unit: "m", low: 0, high: 10, log: false, names: [], hidden: false };
const LOG = { ...AXIS, low: 10, high: 10_000, log: true };
const near = (one, other, tolerance = 1e-9) => assert.ok(Math.abs(one - other) <= tolerance, `${one} is not ${other}`);

it("the scale of an axis leads from a value to its place and back", () => {
  for (const [axis, values] of [[AXIS, [0, 2.5, 10]], [LOG, [10, 317, 10_000]], [{ ...AXIS, low: 5, high: -5 }, [5, 0, -5]]]) {
    const scale = new Scale(axis, 300, 40);
    for (const value of values) near(scale.value(scale.at(value)), value, 1e-9 * Math.max(1, Math.abs(value)));
    assert.equal(scale.at(axis.low), 300);
    near(scale.at(axis.high), 40);
  }
});

describe("the numbers of an axis", () => {
  it("are multiples of 1, 2 or 5, as many as there is room for, and never one alone", () => {
    for (const [low, high, most, values] of [
      [0, 10, 6, [0, 2, 4, 6, 8, 10]], [-0.3, 0.3, 4, [-0.2, 0, 0.2]], [0, 0.48, 3, [0, 0.2, 0.4]], [10, 0, 3, [0, 5, 10]],
    ]) assert.deepEqual(even({ low, high }, most).values, values);
    for (const span of [1e-9, 0.07, 1, 3.3, 42, 999, 1e7]) {
      for (const most of [2, 3, 5, 9]) {
        const { values } = even({ low: -span / 3, high: span }, most);
        assert.ok(values.length <= most + 1 && values.length >= 2, `${values}`);
      }
    }
  });

  for (const [what, axis, most, wanted] of [
    ["have as many decimals as their step, and a sign that is a minus", { ...AXIS, low: -1, high: 1 }, 5, ["−1.0", "−0.5", "0.0", "0.5", "1.0"]],
    ["have commas between thousands", { ...AXIS, low: 0, high: 20_000 }, 3, ["0", "10,000", "20,000"]],
    ["are powers of ten on a logarithmic one", LOG, 5, ["10", "100", "1,000", "10,000"]],
    ["have some between powers of ten where these are few", { ...LOG, low: 0.5, high: 6 }, 5, ["0.5", "1", "2", "5"]],
    ["leave out powers of ten where these are many", { ...LOG, low: 1e-9, high: 1 }, 4, ["10⁻⁹", "10⁻⁶", "0.001", "1"]],
    ["are names where the axis has names", { ...AXIS, low: -0.5, high: 1.5, names: ["on", "off", "beyond"] }, 2, ["on", "off"]],
    ["are none where the axis hides them", { ...AXIS, hidden: true }, 9, []],
  ]) it(what, () => assert.deepEqual(ticksOf(axis, most).map(({ text }) => text), wanted));

  it("are written with a power of ten where they are very large or small", () => {
    assert.deepEqual([0, -2.5, 3.2e-7, -1e8, 123456].map((value) => written(value)), ["0", "−2.5", "3.2×10⁻⁷", "−10⁸", "123,456"]);
  });
});

it("words of a figure give a value with the precision of its axis, and its unit", () => {
  const places = { ...AXIS, names: ["0", "5", "10", "15"], low: -0.5, high: 3.5 };
  for (const [axis, value, words] of [
    [AXIS, 4.4, "4.40 m"], [{ ...AXIS, unit: "", high: 0.3 }, 0.12345, "0.1235"], [{ ...LOG, unit: "" }, 1234.5, "1,235"],
    [{ ...AXIS, names: ["on", "off"] }, 1.2, "off"], [places, 3.5, "15"], [places, -0.5, "0"],
  ]) assert.equal(valueOn(axis, value), words);
  assert.deepEqual([1, 0.5, 0.25, 1 / 3].map((step) => valueOn(AXIS, 4, step)), ["4 m", "4.0 m", "4.00 m", "4.00 m"]);
  assert.deepEqual([named(AXIS, 1), titled({ ...AXIS, title: "" })], ["position 1.00 m", "m"]);
});

describe("the box of a panel", () => {
  const panel = { x: AXIS, y: { ...AXIS, high: 5 }, traces: [] };
  const style = { em: 12, wide: (text) => 8 * text.length };

  it("leaves room for numbers and titles, in steps, so that another digit does not move it", () => {
    const furnished = (y, height = 300, isCompact = false) => furniture({ ...panel, y: { ...panel.y, ...y } }, { width: 400, height }, style, isCompact);
    const around = margins(furnished(), style);
    assert.deepEqual(around, margins(furnished({ title: "another" }), style));
    assert.ok(around.left % 6 === 0 && around.left > 20);
    const low = furnished({ title: "a title that is longer than its axis" }, 100);
    assert.equal(low.lines, 2);
    assert.ok(margins(low, style).left > margins({ ...low, lines: 1 }, style).left);
    const flat = furnished({ title: "probability", unit: "%" }, 60);
    assert.deepEqual([flat.beside, flat.below, furnished({}, 45).below], ["%", "position, m", ""]);
    const bare = margins(furnished({ title: "", unit: "", hidden: true }, 300, true), style);
    assert.ok(bare.left < around.left && bare.bottom < around.bottom);
  });

  it("leaves numbers out that have no room, but its ends", () => {
    const shown = (apart) => withRoom(Array.from({ length: 12 }, (_, place) => ({ text: String(place), at: apart * place, size: 30 })), 5);
    assert.equal(shown(40).length, 12);
    for (const apart of [20, 6]) {
      const left = shown(apart);
      assert.ok(left.length < 12 && left.length >= 2);
      assert.deepEqual([left[0].text, left.at(-1).text], ["0", "11"]);
      left.slice(1).forEach(({ at }, place) => assert.ok(at - left[place].at >= 35));
    }
  });
});

describe("a line of many points", () => {
  const x = Float64Array.from({ length: 1000 }, (_, index) => index / 100);

  it("keeps the first, lowest, highest and last of each column of pixels, and its gaps", () => {
    const drawn = kept(x, x.map((_, index) => ({ 237: 99, 241: -99, 500: NaN })[index] ?? 0));
    assert.ok(drawn.length <= 40);
    for (const index of [0, 237, 241, 500, 999]) assert.ok(drawn.includes(index), String(index));
    assert.deepEqual(drawn, [...drawn].sort((one, other) => one - other));
  });

  it("is left alone where it turns back, has few points, or none", () => {
    const circle = Float64Array.from({ length: 900 }, (_, index) => 5 * Math.cos(index / 100));
    assert.deepEqual([circle, new Float64Array([0, 1]), new Float64Array()].map((line) => kept(line, line).length), [900, 2, 0]);
  });
});

describe("what a pointer is at", () => {
  const [x, y] = [new Float64Array([0, 10, 20]), new Float64Array([0, 10, NaN])];

  it("is the nearest place of a line, also between its points", () => {
    const hit = nearestOn(x, y, 6, 4);
    for (const [found, wanted] of [[hit.x, 5], [hit.y, 5], [hit.distance, Math.SQRT2]]) near(found, wanted);
    assert.equal(nearestOn(new Float64Array([1]), new Float64Array([1]), 0, 0), null);
  });

  it("is the nearest point that is not a gap", () => {
    assert.deepEqual(nearestOf(x, y, 13, 14), { x: 10, y: 10, distance: 5, index: 1 });
    assert.equal(nearestOf(new Float64Array([NaN]), new Float64Array([1]), 0, 0), null);
  });
});

it("a handle offers the parameter's values on the axis, else small steps, which are ratios on a logarithmic axis", () => {
  const [known, unknown, { log, step }] = [boundsOf(AXIS, { minimum: -1, maximum: 8, step: 0.3 }), boundsOf(AXIS), boundsOf(LOG)];
  near(known.low, 0.2);
  assert.deepEqual([known.high, unknown.low, unknown.high, unknown.log], [8, 0, 10, false]);
  assert.ok(unknown.step <= 0.05);
  assert.ok(log && step > 0 && 10 ** step < 1.05);
});

/** What is drawn as the spans of x that its pieces reach over. */
class Pieces {
  spans = [];

  moveTo = (x) => this.spans.push([x, x]);
  rect = (x, _, width) => this.spans.push([x, x + width]);
  closePath = () => {};
  lineTo = (x) => {
    const [low, high] = this.spans.pop();
    this.spans.push([Math.min(low, x), Math.max(high, x)]);
  };
}

describe("a curve with gaps", () => {
  const x = Float64Array.from({ length: 12 }, (_, index) => index);
  const y = Float64Array.from([1, 2, 3, NaN, NaN, NaN, 2, NaN, NaN, 5, 6, 7]);
  const wanted = [[0, 2], [5.25, 6.75], [9, 11]];

  it("leaves them free, line and area, and shows a value that stands alone", () => {
    globalThis.Path2D = Pieces;
    try {
      assert.deepEqual(pathThrough(x, y).spans, wanted);
      let filled;
      const pen = { save: () => {}, restore: () => {}, fill: (path) => (filled = path) };
      const scale = { all: (values) => values };
      KINDS.band.paint({ pen, ink: {}, x: scale, y: scale }, { x, low: y.map((value) => value && 0), high: y, ink: "", opacity: 1 }, []);
      assert.deepEqual(filled.spans, wanted);
    } finally {
      delete globalThis.Path2D;
    }
  });
});
