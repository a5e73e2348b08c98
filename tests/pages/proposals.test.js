import assert from "node:assert/strict";
import { describe, it, mock } from "node:test";

import { Proposals } from "../../frontend_static/session/steering.js";

/** A session that answers when it is told to. */
function stage() {
  let answer = () => {};
  const send = () => new Promise((resolve) => (answer = resolve));
  const proposals = new Proposals(send, new AbortController().signal);
  const answered = async (accepted = true) => {
    answer(accepted);
    for (let turn = 0; turn < 5; turn += 1) await Promise.resolve();
  };
  return { proposals, answered };
}

describe("proposals of the panel", () => {
  it("hold their controls until a while after the last answer", async () => {
    mock.timers.enable({ apis: ["setTimeout"] });
    try {
      const { proposals, answered } = stage();
      proposals.propose("width", 1);
      assert.ok("width" in proposals.held);
      assert.ok(!("count" in proposals.held));
      await answered();
      assert.ok("width" in proposals.held);
      mock.timers.tick(400);
      assert.ok(!("width" in proposals.held));
    } finally {
      mock.timers.reset();
    }
  });

  it("let go at once when the last one was refused", async () => {
    const { proposals, answered } = stage();
    proposals.propose("width", -1);
    await answered(false);
    assert.ok(!("width" in proposals.held));
  });
});
