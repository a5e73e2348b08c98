import assert from "node:assert/strict";
import { it } from "node:test";

import { Store } from "../../frontend_static/session/store.js";
import { Exploration, Loss } from "../../frontend_static/session/why/loss.js";
import { changes, hello } from "./making.js";

/** The store of a session that has begun, and the signal of its page. */
function begun() {
  globalThis.addEventListener = () => {};
  const [store, end] = [new Store(), new AbortController()];
  store.receive(hello());
  return { store, end };
}

it("an exploration is asked for once a run, again where it failed, and is stale while the run is another one", async (context) => {
  const job = { id: "j", state: "failed", error: "no room", result: null, branch: "b0", stale: false };
  const asked = context.mock.method(globalThis, "fetch", async () => globalThis.Response.json(job));
  const { store, end } = begun();
  const exploration = new Exploration(store, end.signal);
  await exploration.begin({ kind: "what-if", frame: 5 });
  assert.equal(exploration.error.value, "no room");
  Object.assign(job, { state: "done", result: { findings: [] } });
  for (let time = 0; time < 2; time += 1) await exploration.begin({ kind: "what-if", frame: 5 });
  assert.deepEqual([asked.mock.callCount(), exploration.isStale], [2, false]);
  for (const [timeline, isStale] of [[[{ frame: 3, values: {} }], true], [[], false]]) {
    store.receive(changes({ timeline }));
    assert.equal(exploration.isStale, isStale);
  }
  Object.assign(job, { branch: "b1", result: { findings: ["of a branch that a command has just made"] } });
  await exploration.begin({ kind: "what-if", frame: 6 });
  assert.deepEqual(exploration.found.value?.result, { findings: [] });
});

it("a loss that is explained too late, after its page or its branch was left, is not shown and begins no exploration", async (context) => {
  const branches = ["b0", "b1"].map((id) => ({ id, parent: null, frame: 0 }));
  for (const leave of [({ end }) => end.abort(), ({ store }) => store.receive(changes({ branch: "b1", branches }))]) {
    const answers = [];
    const asked = context.mock.method(globalThis, "fetch", () => new Promise((resolve) => answers.push(resolve)));
    const page = begun();
    const loss = new Loss({ store: page.store, card: { value: null }, signal: page.end.signal });
    const asking = loss.ask(5);
    leave(page);
    answers[0](globalThis.Response.json({ diagnosis: { lost: true, frame: 5 } }));
    await asking;
    assert.deepEqual([asked.mock.calls.filter(({ arguments: [, { method }] }) => method === "POST"), loss.explanation.value], [[], null]);
  }
});
