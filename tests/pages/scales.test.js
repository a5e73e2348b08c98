import assert from "node:assert/strict";
import { before, describe, it } from "node:test";

import { DIVERGING, VIRIDIS } from "../../frontend_static/shared/palette.js";
import { diverging, viridis } from "../../frontend_static/shared/theme.js";
import { endOf, methodLook, quantitiesOf } from "../../frontend_static/sweep/store.js";

let medium = "screen";

before(() => {
  // A page in light colours.
  globalThis.document = { documentElement: { dataset: { theme: "light" } } };
  globalThis.matchMedia = (query) => ({ matches: query === medium });
});

describe("the colours of a map", () => {
  it("begin and end where the palette does, and clip what lies beyond", () => {
    assert.deepEqual([0, 1, 7, -1].map(viridis), [0, -1, -1, 0].map((place) => VIRIDIS.at(place)));
  });

  it("are neutral in the middle of a difference and each method's own at the ends", () => {
    assert.deepEqual([0, -1, 1].map(diverging), [3, 0, 6].map((place) => DIVERGING[place].light));
  });

  it("are those of a dark page where dark was chosen, but on paper", () => {
    const { dataset } = globalThis.document.documentElement;
    dataset.theme = "dark";
    for (const [shown, scheme] of [["screen", "dark"], ["print", "light"]]) {
      medium = shown;
      assert.deepEqual(diverging(0), DIVERGING[3][scheme]);
    }
    [medium, dataset.theme] = ["screen", "light"];
  });
});

describe("the ends of a scale", () => {
  for (const [what, values, most, words] of [
    ["round", [1, 2, null, 2.8], 3, ""],
    ["not moved by a few outliers", [...Array(99).fill(1.9), 500], 2, " or more"],
    ["1 where nothing is known", [null, null], 1, ""],
  ]) it(`are ${what}`, () => assert.deepEqual(endOf({ isShare: false }, values), { most, words }));
});

describe("a measure's scale", () => {
  const measured = (how, better) => quantitiesOf({ judged: false, has_truth: false, measures: [{ name: "m", title: "M", unit: "", how, better }], unit: "" })[0];
  /** @param {number[]} values */
  const cells = (values) => ({ planned: 1, maps: [{ runs: values.map(() => 1), problems: values.map(() => 0), measures: { m: values } }] });

  it("is bright where the measure is good, whichever end that is", () => {
    for (const [better, best] of [["higher", 1], ["lower", 0]]) {
      const shown = cells([0, 1]);
      const look = methodLook({ sweep: { state: "done" }, cells: shown, quantity: measured("share", better), end: { most: 1 } }, shown.maps[0]);
      assert.deepEqual(look(best).colour, VIRIDIS.at(-1));
      assert.deepEqual(look(1 - best).colour, VIRIDIS[0]);
    }
  });
});
