import assert from "node:assert/strict";
import { describe, it } from "node:test";

import { inWords } from "../../frontend_static/session/panel/sequence.js";
import { parameterValue } from "../../frontend_static/shared/format.js";

const TITLES = { p: "Predict", m: "Measure" };

describe("the words of a sequence", () => {
  it("count its steps and name the newest", () => {
    assert.equal(inWords("", TITLES), "nothing yet");
    assert.equal(inWords("p", TITLES), "1 step: predict");
    assert.equal(inWords("pm", TITLES), "2 steps: predict, measure");
    assert.equal(inWords("ppppm", TITLES), "5 steps: … predict, measure");
  });

  it("say on a timeline where there is none", () => {
    assert.equal(parameterValue("", { unit: "", kind: "sequence" }), "none");
    assert.equal(parameterValue("pm", { unit: "", kind: "sequence" }), "pm");
  });
});
