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

  send = (text) => this.sent.push(text);
  close = () => (this.isClosed = true);

  opens() {
    this.readyState = FakeSocket.OPEN;
    this.dispatchEvent(new Event("open"));
  }

  hears = (data) => this.dispatchEvent(Object.assign(new Event("message"), { data }));

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
    const told = (what) => [what, (event) => heard.push(event?.code ?? event?.type ?? what)];
    const on = Object.fromEntries(["message", "drawing", "opened", "lost", "closed", "gone"].map(told));
    const stream = new Stream(on, { address: () => `ws://place/${FakeSocket.made.length}`, look, signal: end.signal });
    const [first] = FakeSocket.made;
    /** Have a line break, and wait for so many ms, one after the other. */
    const breaks = async (socket, code, ...waits) => {
      socket.ends(code);
      await turn();
      for (const ms of waits) test.mock.timers.tick(ms);
    };
    const online = () => {
      page.dispatchEvent(new Event("online"));
      test.mock.timers.tick(0);
    };
    return { stream, first, end, heard, breaks, online, tick: (ms) => test.mock.timers.tick(ms), made: () => FakeSocket.made.length };
  }

  it("tries again after a while, at a new address, and longer each time", async (test) => {
    const { first, heard, breaks, tick, made } = stage(test);
    first.opens();
    first.hears('{"type":"hello"}');
    await breaks(first);
    assert.equal(made(), 1);
    tick(320);
    assert.deepEqual([made(), FakeSocket.made[1].address, heard], [2, "ws://place/1", ["opened", "hello", 1006, "lost"]]);
    await breaks(FakeSocket.made[1], 1006, 320);
    assert.equal(made(), 2);
    tick(320);
    assert.equal(made(), 3);
  });

  for (const code of [1006, 4404]) {
    it(`stays away where there is nothing to hear any more, and asks only where the code ${code} does not say so`, async (test) => {
      const look = () => Promise.reject(new ApiError(404, { message: `${heard.push("asked")}` }));
      const { first, heard, breaks, online, tick, made } = stage(test, look);
      await breaks(first, code);
      online();
      tick(10_000);
      assert.deepEqual([heard, made()], [[code, "lost", ...(code === 1006 ? ["asked"] : []), "gone"], 1]);
    });
  }

  it("connects anew at once where it is told to, and nobody hears of that", async (test) => {
    const { stream, first, heard, breaks, made } = stage(test);
    first.opens();
    stream.again();
    await breaks(first, 1006, 0);
    assert.deepEqual([first.isClosed, heard, made()], [true, ["opened"], 2]);
  });

  it("ends with its signal, and nothing is told of that", async (test) => {
    const { first, end, heard, breaks, made } = stage(test);
    end.abort();
    assert.ok(!first.isClosed, "a browser would complain of one that is closed before it opens");
    first.opens();
    assert.ok(first.isClosed);
    await breaks(first, 1006, 10_000);
    assert.deepEqual([heard, made()], [[], 1]);
  });

  it("does not wait for a farewell where pings stay unanswered, and hears nothing of that line any more", async (test) => {
    const { first, heard, tick, made } = stage(test);
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
