import assert from "node:assert/strict";
import { it } from "node:test";

import { Store } from "../../frontend_static/session/store.js";
import { Loss } from "../../frontend_static/session/why/loss.js";

it("a loss that is explained after its session has left the page begins no exploration", async (context) => {
  globalThis.addEventListener = () => {};
  let answer = () => {};
  const told = () => globalThis.Response.json({ diagnosis: { lost: true, frame: 5 } });
  const asked = context.mock.method(globalThis, "fetch", () => new Promise((resolve) => (answer = () => resolve(told()))));
  const store = new Store();
  store.receive({ type: "hello", diagnostics: {}, session: { id: "s", state: "ready", branch: "b0", branches: [], trackers: [], parameters: {}, recipe: {} } });
  const end = new AbortController();
  const asking = new Loss({ store, able: true, signal: end.signal }).ask(5);
  end.abort();
  answer();
  await asking;
  assert.equal(asked.mock.callCount(), 1);
});
