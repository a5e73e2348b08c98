import assert from "node:assert/strict";
import { describe, it } from "node:test";

import { marks, trackerTitle } from "../../frontend_static/session/steering.js";

const session = {
  declarations: [{ name: "width", title: "Width", unit: "px" }],
  trackers: [{ id: "a", title: "Method A" }, { id: "b", title: "Method B" }],
  timeline: [
    { frame: 0, values: { width: 40 }, before: {}, moved: [] },
    { frame: 10, values: { width: 60, tracker: "b" }, before: { width: 40, tracker: "a" }, moved: [] },
    { frame: 20, values: { width: 60, depth: 2 }, before: { width: 60 }, moved: [] },
    { frame: 30, values: {}, before: {}, moved: ["Particle 7 moved to (312, 140)"] },
  ],
};

describe("the marks of a timeline", () => {
  it("leave out what the run began with, and name the tracker first", () => {
    assert.deepEqual(marks(session), [
      { frame: 10, lines: ["Tracker Method A → Method B", "Width 40 → 60 px"] },
      { frame: 20, lines: ["Width 60 → 60 px", "depth 2"] },
      { frame: 30, lines: ["Particle 7 moved to (312, 140)"] },
    ]);
  });

  it("say of a file that it was brought in or taken away, not its text", () => {
    const declarations = [{ name: "face", title: "Begin with", kind: "file" }];
    const timeline = [
      { frame: 5, values: { face: "{}" }, before: { face: "" }, moved: [] },
      { frame: 6, values: { face: "" }, before: { face: "{}" }, moved: [] },
    ];
    assert.deepEqual(marks({ ...session, declarations, timeline }).map(({ lines }) => lines), [["Begin with"], ["Begin with: none"]]);
  });

  it("leave out what is only drawn, where nothing else changes", () => {
    const declarations = [{ name: "shown", title: "Shown", kind: "integer", role: "drawing" }];
    const timeline = [{ frame: 5, values: { shown: 2 }, before: { shown: 1 }, moved: [] }, { frame: 6, values: { shown: 1, depth: 2 }, before: { shown: 2 }, moved: [] }];
    assert.deepEqual(marks({ ...session, declarations, timeline }).map(({ frame }) => frame), [6]);
  });

  it("know a tracker by its title, else by its name, else not at all", () => {
    assert.equal(trackerTitle(session, "a"), "Method A");
    assert.equal(trackerTitle(session, "z"), "z");
    assert.equal(trackerTitle(session, undefined), "–");
  });
});
