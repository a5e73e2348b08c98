import assert from "node:assert/strict";
import { describe, it } from "node:test";

import { bookmark, Steering } from "../../frontend_static/session/steering.js";
import { Store } from "../../frontend_static/session/store.js";
import { effect } from "../../frontend_static/vendor/preact.js";
import { changes, hello } from "./making.js";

/** A store that has heard so many messages. */
function told(...messages) {
  const store = new Store();
  for (const message of messages) store.receive(message);
  return store;
}

describe("the store of a session", () => {
  it("hears nothing before it was greeted, and then takes everything over", () => {
    const store = told(changes({ position: 5 }));
    assert.deepEqual([store.session, store.isAwake], [null, false]);
    assert.throws(() => store.known, /has not been loaded/);
    store.receive(hello());
    assert.deepEqual([store.connection.value, store.history.length, store.isAwake], ["open", 1, true]);
  });

  it("knows where a run is on its way to, until it is there", () => {
    const store = told(hello({ goal: 40 }), changes({ position: 5, computed: 5 }));
    assert.equal(store.known.goal, 40);
    store.receive(changes({ position: 40, computed: 40, goal: null }));
    assert.equal(store.known.goal, null);
  });

  it("is followed field by field, and its history by rows, by whatever reads them", () => {
    const [store, positions, speeds, frames, known] = [new Store(), [], [], [], []];
    effect(() => void positions.push(store.session?.position));
    effect(() => void speeds.push(store.session?.speed));
    effect(() => void frames.push(store.history.length));
    effect(() => void known.push(store.session && [store.history.length, store.history.at(store.known.position)?.frame]));
    store.receive(hello());
    store.receive(changes({ position: 2, computed: 2 }, [{ frame: 1 }, { frame: 2 }]));
    store.receive(hello({ position: 2 }));
    assert.deepEqual([positions, speeds, frames], [[undefined, 0, 2], [undefined, 1], [0, 1, 3, 1]]);
    assert.deepEqual(known, [null, [1, 0], [3, 2], [1, undefined]], "the frames are known as soon as it stands on one of them");
  });

  it("gives a new branch its parent's past", () => {
    const branches = [{ id: "b0", parent: null, frame: 0 }, { id: "b1", parent: "b0", frame: 1 }];
    const store = told(hello(), changes({}, [{ frame: 1, estimate: [1] }, { frame: 2, estimate: [2] }]), changes({ branches }));
    assert.deepEqual([store.historyOf("b1").length, store.history.length], [2, 3]);
  });
});

it("a read-only session is awake, and the page sends it no command", async (context) => {
  const asked = context.mock.method(globalThis, "fetch", () => Promise.reject(new Error("nothing is asked for")));
  const store = new Store({ readOnly: true });
  store.receive(hello({ position: 10 }));
  assert.deepEqual([store.isAwake, store.isSteerable], [true, false]);
  const steering = new Steering(store, new AbortController().signal);
  for (const [act, ...value] of [["toggle"], ["play"], ["newest"], ["beforeLoss"], ["seek", 2], ["step", 1], ["setSpeed", 2]]) await steering[act](...value);
  await bookmark(store);
  assert.equal(asked.mock.callCount(), 0);
  assert.equal(store.known.speed, 1);
});
