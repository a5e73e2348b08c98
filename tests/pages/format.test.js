import assert from "node:assert/strict";
import { describe, it } from "node:test";

import { progressWords } from "../../frontend_static/shared/api.js";
import { bytes, count, duration, measureValue, moment, number, parameterValue, quantity, smallestSpan, speed } from "../../frontend_static/shared/format.js";
import { share2, short } from "../../frontend_static/sweep/store.js";

/** What is written as a person reads it: a function, and for each of its arguments what comes of them. */
const TABLE = {
  "numbers have the decimals that were asked for, and a dash where there is none": [number, [
    [[1.25, 1], "1.3"], [[0, 2], "0.00"], ...[null, undefined, NaN, Infinity, "1"].map((missing) => [[missing], "–"])]],
  "quantities of pixels have tenths, pure numbers thousandths, frames no decimals, and whole ones that count things": [quantity, [
    [[1.23456, "px"], "1.2"], [[1.23456, ""], "1.235"], [[300, "frames"], "300"], [[null, "frames"], "–"],
    [[60, ""], "60"], [[1165, ""], "1165"], [[1, ""], "1.000"], [[0, ""], "0.000"]]],
  "axes of what counts things are whole": [smallestSpan, [[["", 1165], 1], [["", 1], 0.01], [[""], 0.01], [["px"], 1]]],
  "bytes climb through the units and keep three digits": [bytes, [
    [[999], "999 B"], [[1000], "1.0 kB"], [[12_345_678], "12.3 MB"], [[123_456_789], "123 MB"], [[5e12], "5000 GB"]]],
  "parameters are as short as they stay exact, with their unit": [parameterValue, [
    [[0.1 + 0.2, null], "0.3"], [[40, { unit: "px" }], "40 px"], [["soft", { unit: "" }], "soft"], [[true, null], "true"]]],
  "times of a sweep are given in units that fit": [duration, [
    [[0.4], "1 s"], [[12], "12 s"], [[75], "1 min 15 s"], [[3600], "60 min"], [[90_000], "25.0 h"], [[null], "–"]]],
  "speeds say when there is no limit": [speed, [[[0], "max"], [[0.1], "0.1×"], [[1], "1×"], [[10], "10×"]]],
  "counts have a plural": [count, [[[1, "frame"], "1 frame"], [[12_345, "frame"], "12,345 frames"], [[0, "run"], "0 runs"]]],
  "shares in a cell of a map need little room": [share2, [[[0], "0"], [[1], "1"], [[0.5], ".50"], [[0.572], ".57"]]],
  "numbers in a cell of a map need little room": [short, [[[123.4], "123"], [[12.34], "12.3"], [[1.234], "1.23"], [[0.01234], "0.012"]]],
  "progress is told in frames, and in time as soon as a rate is known": [progressWords, [
    [[1200, 4000, 0.5, 100], "Computing frame 1,200 of 4,000"], [[1200, 4000, 30, 0], "Computing frame 1,200 of 4,000"],
    [[1200, 4000, 30, 1200], "Computing frame 1,200 of 4,000, about 1 min 10 s left"]]],
  "measures are a share, a number of frames, or a number with its unit": [measureValue, [
    [[0.154, { how: "share", unit: "" }], "15 %"], [[null, { how: "share", unit: "" }], "–"],
    [[8, { how: "until", unit: "frames" }, 60], "8 of 60"], [[8.4, { how: "until", unit: "frames" }], "8 frames"],
    [[2.94, { how: "median", unit: "px" }], "2.9 px"], [[0.205, { how: "median", unit: "" }], "0.20"]]],
};

describe("as a person reads them", () => {
  for (const [name, [written, cases]] of Object.entries(TABLE)) {
    it(name, () => assert.deepEqual(cases.map(([given]) => written(...given)), cases.map(([, words]) => words)));
  }

  it("times name the day only if it is another one", () => {
    const now = new Date();
    now.setHours(14, 3);
    assert.deepEqual([now.toISOString(), "2020-02-03T10:00:00", "no date"].map(moment), ["today, 14:03", "3 Feb 2020, 10:00", ""]);
  });
});
