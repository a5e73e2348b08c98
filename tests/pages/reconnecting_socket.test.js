import assert from "node:assert/strict";
import { beforeEach, describe, it } from "node:test";

import { ReconnectingSocket } from "../../frontend_static/shared/reconnecting_socket.js";

/* global Event, EventTarget */

/** A websocket that does what it is told to. */
class FakeSocket extends EventTarget {
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

describe("a socket that comes back", () => {
  /** @param {(event: CloseEvent|null) => boolean} closed */
  function stage(test, closed = () => true) {
    test.mock.timers.enable({ apis: ["setTimeout"] });
    const end = new AbortController();
    const heard = [];
    const events = [];
    const told = (event) => {
      events.push(event?.code ?? null);
      return closed(event);
    };
    const socket = new ReconnectingSocket(() => `ws://place/${FakeSocket.made.length}`, { message: (data) => heard.push(data), closed: told }, end.signal);
    return { socket, end, heard, events, tick: (ms) => test.mock.timers.tick(ms), made: () => FakeSocket.made.length };
  }

  it("tries again after a while, at a new address, and longer each time", async (test) => {
    const { heard, tick, made } = stage(test);
    FakeSocket.made[0].opens();
    FakeSocket.made[0].hears("one");
    FakeSocket.made[0].ends();
    await turn();
    assert.equal(made(), 1);
    tick(320);
    assert.deepEqual([made(), FakeSocket.made[1].address, heard], [2, "ws://place/1", ["one"]]);
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

  it("stays away where who hears of it says so", async (test) => {
    const { events, tick, made } = stage(test, ({ code }) => code !== 4404);
    FakeSocket.made[0].ends(4404);
    await turn();
    page.dispatchEvent(new Event("online"));
    tick(10_000);
    assert.deepEqual([events, made()], [[4404], 1]);
  });

  it("ends with its signal, and nothing is told of that", async (test) => {
    const { end, events, tick, made } = stage(test);
    end.abort();
    const [last] = FakeSocket.made;
    assert.ok(last.isClosed);
    last.ends();
    await turn();
    tick(10_000);
    assert.deepEqual([events, made()], [[], 1]);
  });

  it("does not wait for a farewell where the line is dead, and hears nothing of it any more", async (test) => {
    const { socket, heard, events, tick, made } = stage(test);
    const [first] = FakeSocket.made;
    first.opens();
    socket.send({ type: "ping" });
    socket.giveUp();
    await turn();
    tick(320);
    first.hears("late");
    first.ends();
    assert.deepEqual([first.sent, events, heard, made()], [['{"type":"ping"}'], [null], [], 2]);
    socket.send({ type: "ping" });
    assert.deepEqual(FakeSocket.made[1].sent, []);
  });
});
