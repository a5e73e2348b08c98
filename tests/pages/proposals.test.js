import assert from "node:assert/strict";
import { describe, it, mock } from "node:test";

import { Proposals } from "../../frontend_static/session/steering.js";

/** A session that answers when it is told to. */
function stage() {
  const end = new AbortController();
  const asked = [];
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
  return { proposals, asked, answered, end };
}

describe("proposals of the panel", () => {
  it("are sent one at a time, of each parameter the newest", async () => {
    const { proposals, asked, answered } = stage();
    proposals.propose("width", 1);
    proposals.propose("width", 2);
    proposals.propose("count", 9);
    proposals.propose("width", 3);
    assert.deepEqual(asked, [{ width: 1 }]);
    await answered();
    assert.deepEqual(asked, [{ width: 1 }, { width: 3, count: 9 }]);
  });

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

  it("end with the page's part that they belong to", async () => {
    const { proposals, asked, answered, end } = stage();
    proposals.propose("width", 1);
    proposals.propose("width", 2);
    end.abort();
    await answered();
    assert.deepEqual(asked, [{ width: 1 }]);
  });
});
