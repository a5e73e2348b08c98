import assert from "node:assert/strict";
import { beforeEach, describe, it } from "node:test";

import { ApiError } from "../../frontend_static/shared/api.js";
import { Stream } from "../../frontend_static/shared/stream.js";

/* global Event, EventTarget */

/** A websocket that does what it is told to. */
class FakeSocket extends EventTarget {
  static CONNECTING = 0;
  static OPEN = 1;
  /** @type {FakeSocket[]} */
  static made = [];
  readyState = 0;
  sent = [];

  constructor(address) {
    super();
    this.address = address;
    FakeSocket.made.push(this);
  }

  send(text) {
    this.sent.push(text);
  }

  close() {
    this.isClosed = true;
  }

  opens() {
    this.readyState = FakeSocket.OPEN;
    this.dispatchEvent(new Event("open"));
  }

  hears(data) {
    this.dispatchEvent(Object.assign(new Event("message"), { data }));
  }

  ends(code = 1006) {
    this.readyState = 3;
    this.dispatchEvent(Object.assign(new Event("close"), { code }));
  }
}

const page = new EventTarget();
const turn = () => new Promise((resolve) => setImmediate(resolve));

beforeEach(() => {
  FakeSocket.made = [];
  Object.assign(globalThis, { WebSocket: FakeSocket, document: page, addEventListener: page.addEventListener.bind(page) });
});

describe("a stream", () => {
  /** @param {() => Promise<unknown>} look */
  function stage(test, look = () => Promise.resolve()) {
    test.mock.timers.enable({ apis: ["setTimeout", "setInterval"] });
    const end = new AbortController();
    const heard = [];
    const told = (what) => (event) => heard.push(event?.code ?? event?.type ?? what);
    const on = { message: told("message"), drawing: told("drawing"), opened: told("opened"), lost: told("lost"), closed: told("closed"), gone: told("gone") };
    const stream = new Stream(on, { address: () => `ws://place/${FakeSocket.made.length}`, look, signal: end.signal });
    const tick = (ms) => test.mock.timers.tick(ms);
    return { stream, end, heard, tick, made: () => FakeSocket.made.length };
  }

  it("tells what comes, as text or as a drawing, and keeps pongs for itself", (test) => {
    const { heard } = stage(test);
    FakeSocket.made[0].opens();
    FakeSocket.made[0].hears('{"type":"hello"}');
    FakeSocket.made[0].hears(new ArrayBuffer(8));
    FakeSocket.made[0].hears('{"type":"pong"}');
    assert.deepEqual(heard, ["opened", "hello", "drawing"]);
  });

  it("tries again after a while, at a new address, and longer each time", async (test) => {
    const { heard, tick, made } = stage(test);
    FakeSocket.made[0].opens();
    FakeSocket.made[0].hears('{"type":"hello"}');
    FakeSocket.made[0].ends();
    await turn();
    assert.equal(made(), 1);
    tick(320);
    assert.deepEqual([made(), FakeSocket.made[1].address, heard], [2, "ws://place/1", ["opened", "hello", 1006, "lost"]]);
    FakeSocket.made[1].ends();
    await turn();
    tick(320);
    assert.equal(made(), 2);
    tick(320);
    assert.equal(made(), 3);
  });

  it("comes back at once when the browser is online again", async (test) => {
    const { tick, made } = stage(test);
    FakeSocket.made[0].ends();
    await turn();
    page.dispatchEvent(new Event("online"));
    tick(0);
    assert.equal(made(), 2);
    page.dispatchEvent(new Event("online"));
    tick(0);
    assert.equal(made(), 2);
  });

  for (const code of [1006, 4404]) {
    it(`stays away where there is nothing to hear any more, and asks only where the code ${code} does not say so`, async (test) => {
      const { heard, tick, made } = stage(test, () => Promise.reject(new ApiError(404, { message: `${heard.push("asked")}` })));
      FakeSocket.made[0].ends(code);
      await turn();
      page.dispatchEvent(new Event("online"));
      tick(10_000);
      assert.deepEqual([heard, made()], [[code, "lost", ...(code === 1006 ? ["asked"] : []), "gone"], 1]);
    });
  }

  it("connects anew at once where it is told to, and nobody hears of that", async (test) => {
    const { stream, heard, tick, made } = stage(test);
    const [first] = FakeSocket.made;
    first.opens();
    stream.again();
    first.ends();
    await turn();
    tick(0);
    assert.deepEqual([first.isClosed, heard, made()], [true, ["opened"], 2]);
  });

  it("ends with its signal, and nothing is told of that", async (test) => {
    const { end, heard, tick, made } = stage(test);
    end.abort();
    const [last] = FakeSocket.made;
    assert.ok(!last.isClosed, "a browser would complain of one that is closed before it opens");
    last.opens();
    assert.ok(last.isClosed);
    last.ends();
    await turn();
    tick(10_000);
    assert.deepEqual([heard, made()], [[], 1]);
  });

  it("does not wait for a farewell where pings stay unanswered, and hears nothing of that line any more", async (test) => {
    const { heard, tick, made } = stage(test);
    const [first] = FakeSocket.made;
    first.opens();
    tick(15_000);
    await turn();
    tick(320);
    first.hears('{"type":"hello"}');
    first.ends();
    assert.deepEqual(first.sent.map((text) => JSON.parse(text).type), ["ping", "ping"]);
    assert.deepEqual([heard, made()], [["opened", "lost"], 2]);
  });
});
