import assert from "node:assert/strict";
import { describe, it } from "node:test";

import { marks, Proposals } from "../../frontend_static/session/steering.js";

describe("proposals of the panel", () => {
  /** A session that answers when it is told to. */
  function stage(context) {
    context.mock.timers.enable({ apis: ["setTimeout"] });
    const [asked, end] = [[], new AbortController()];
    let answer = () => {};
    const send = (values) => {
      asked.push(values);
      return new Promise((resolve) => (answer = resolve));
    };
    const proposals = new Proposals(send, end.signal);
    const answered = async (accepted = true) => {
      answer(accepted);
      for (let turn = 0; turn < 5; turn += 1) await Promise.resolve();
    };
    const propose = (...wishes) => wishes.forEach(([name, value]) => proposals.propose(name, value));
    return { propose, held: () => Object.keys(proposals.held), asked, answered, end };
  }

  it("are sent one at a time, of each parameter the newest", async (context) => {
    const { propose, asked, answered } = stage(context);
    propose(["width", 1], ["width", 2], ["count", 9], ["width", 3]);
    assert.deepEqual(asked, [{ width: 1 }]);
    await answered();
    assert.deepEqual(asked, [{ width: 1 }, { width: 3, count: 9 }]);
  });

  it("hold their controls until a while after the last answer, or until that refuses", async (context) => {
    const { propose, held, answered } = stage(context);
    propose(["width", 1]);
    assert.deepEqual(held(), ["width"]);
    await answered();
    assert.deepEqual(held(), ["width"]);
    context.mock.timers.tick(400);
    assert.deepEqual(held(), []);
    propose(["width", -1]);
    await answered(false);
    assert.deepEqual(held(), []);
  });

  it("end with the page's part that they belong to", async (context) => {
    const { propose, asked, answered, end } = stage(context);
    propose(["width", 1], ["width", 2]);
    end.abort();
    await answered();
    assert.deepEqual(asked, [{ width: 1 }]);
  });
});

describe("the marks of a timeline", () => {
  const session = {
    declarations: [
      { name: "width", title: "Width", unit: "px" },
      { name: "face", title: "Begin with", kind: "file" },
      { name: "shown", title: "Shown", kind: "integer", role: "drawing" },
    ],
    trackers: [{ id: "a", title: "Method A" }, { id: "b", title: "Method B" }],
  };
  const marked = (...timeline) => marks({ ...session, timeline: timeline.map(([frame, values, before, ...moved]) => ({ frame, values, before, moved })) });

  it("leave out what the run began with and what is only drawn, name the tracker first, and say what was moved", () => {
    const timeline = [
      [0, { width: 40 }, {}],
      [5, { shown: 2 }, { shown: 1 }],
      [10, { width: 60, tracker: "b" }, { width: 40, tracker: "a" }],
      [20, { width: 60, depth: 2, shown: 1 }, { width: 60, shown: 2 }],
      [30, {}, {}, "Particle 7 moved to (312, 140)"],
    ];
    assert.deepEqual(marked(...timeline).map(({ frame, lines }) => [frame, ...lines]), [
      [10, "Tracker Method A → Method B", "Width 40 → 60 px"],
      [20, "Width 60 → 60 px", "depth 2", "Shown 2 → 1"],
      [30, "Particle 7 moved to (312, 140)"],
    ]);
  });
});
