import assert from "node:assert/strict";
import { describe, it } from "node:test";

import { progressWords } from "../../frontend_static/shared/api.js";
import { bytes, count, duration, measureValue, moment, number, parameterValue, quantity, smallestSpan, speed } from "../../frontend_static/shared/format.js";
import { share2, short } from "../../frontend_static/sweep/store.js";

describe("numbers as a person reads them", () => {
  it("have the decimals that were asked for, and a dash where there is none", () => {
    assert.equal(number(1.25, 1), "1.3");
    assert.equal(number(0, 2), "0.00");
    for (const missing of [null, undefined, NaN, Infinity, "1"]) assert.equal(number(missing), "–");
  });

  it("of pixels have tenths, pure numbers thousandths, frames no decimals", () => {
    assert.equal(quantity(1.23456, "px"), "1.2");
    assert.equal(quantity(1.23456, ""), "1.235");
    assert.equal(quantity(300, "frames"), "300");
    assert.equal(quantity(null, "frames"), "–");
  });

  it("that count things are whole, and so are the axes of their plots", () => {
    assert.deepEqual([60, 1165, 1, 0].map((value) => quantity(value, "")), ["60", "1165", "1.000", "0.000"]);
    assert.deepEqual([smallestSpan("", 1165), smallestSpan("", 1), smallestSpan(""), smallestSpan("px")], [1, 0.01, 0.01, 1]);
  });

  it("of bytes climb through the units and keep three digits", () => {
    assert.equal(bytes(999), "999 B");
    assert.equal(bytes(1000), "1.0 kB");
    assert.equal(bytes(12_345_678), "12.3 MB");
    assert.equal(bytes(123_456_789), "123 MB");
    assert.equal(bytes(5e12), "5000 GB");
  });

  it("of parameters are as short as they stay exact, with their unit", () => {
    assert.equal(parameterValue(0.1 + 0.2, null), "0.3");
    assert.equal(parameterValue(40, { unit: "px" }), "40 px");
    assert.equal(parameterValue("soft", { unit: "" }), "soft");
    assert.equal(parameterValue(true, null), "true");
  });

  it("of speeds say when there is no limit", () => {
    assert.deepEqual([0, 0.1, 1, 10].map(speed), ["max", "0.1×", "1×", "10×"]);
  });

  it("count with a plural", () => {
    assert.equal(count(1, "frame"), "1 frame");
    assert.equal(count(12_345, "frame"), "12,345 frames");
    assert.equal(count(0, "run"), "0 runs");
  });

  it("in a cell of a map need little room", () => {
    assert.deepEqual([0, 1, 0.5, 0.572].map(share2), ["0", "1", ".50", ".57"]);
    assert.deepEqual([123.4, 12.34, 1.234, 0.01234].map(short), ["123", "12.3", "1.23", "0.012"]);
  });
});

describe("times", () => {
  it("name the day only if it is another one", () => {
    const now = new Date();
    now.setHours(14, 3);
    assert.equal(moment(now.toISOString()), "today, 14:03");
    assert.match(moment("2020-02-03T10:00:00"), /^3 Feb 2020, 10:00$/);
    assert.equal(moment("no date"), "");
  });

  it("of a sweep are given in units that fit", () => {
    for (const seconds of [0.4, 12, 75, 3600, 90_000]) assert.match(duration(seconds), /\d.*(s|min|h|d)/);
  });
});

describe("how far long work is", () => {
  it("is told in frames, and in time as soon as a rate is known", () => {
    assert.equal(progressWords(1200, 4000, 0.5, 100), "Computing frame 1,200 of 4,000");
    assert.equal(progressWords(1200, 4000, 30, 0), "Computing frame 1,200 of 4,000");
    assert.equal(progressWords(1200, 4000, 30, 1200), "Computing frame 1,200 of 4,000, about 1 min 10 s left");
  });
});

describe("measures", () => {
  it("are a share, a number of frames, or a number with its unit", () => {
    assert.equal(measureValue(0.154, { how: "share", unit: "" }), "15 %");
    assert.equal(measureValue(8, { how: "until", unit: "frames" }, 60), "8 of 60");
    assert.equal(measureValue(8.4, { how: "until", unit: "frames" }), "8 frames");
    assert.equal(measureValue(2.94, { how: "median", unit: "px" }), "2.9 px");
    assert.equal(measureValue(0.205, { how: "median", unit: "" }), "0.20");
    assert.equal(measureValue(null, { how: "share", unit: "" }), "–");
  });
});
