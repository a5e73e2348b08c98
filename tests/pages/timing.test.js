import assert from "node:assert/strict";
import { describe, it, mock } from "node:test";

import { after, later, latest, throttle } from "../../frontend_static/shared/timing.js";

describe("a throttle", () => {
  it("serves the last request and no more than one in a while", (test) => {
    test.mock.timers.enable({ apis: ["setTimeout"] });
    const work = mock.fn();
    const ask = throttle(work, 100);
    for (let time = 0; time < 5; time += 1) ask();
    test.mock.timers.tick(1000);
    assert.equal(work.mock.callCount(), 1);
    ask();
    test.mock.timers.tick(1000);
    assert.equal(work.mock.callCount(), 2);
  });

  it("leaves no timer behind when its signal ends it", (test) => {
    test.mock.timers.enable({ apis: ["setTimeout"] });
    const [work, end] = [mock.fn(), new AbortController()];
    const ask = throttle(work, 100, end.signal);
    ask();
    end.abort();
    ask();
    test.mock.timers.tick(1000);
    assert.equal(work.mock.callCount(), 0);
  });
});

describe("waiting", () => {
  it("is ended by a signal, by itself, or by who asked for it", (test) => {
    test.mock.timers.enable({ apis: ["setTimeout"] });
    const [work, end] = [mock.fn(), new AbortController()];
    later(work, 10, end.signal);
    later(work, 10)();
    const never = mock.fn();
    after(10, end.signal).then(never);
    end.abort();
    later(work, 10, end.signal);
    test.mock.timers.tick(100);
    assert.equal(work.mock.callCount(), 0);
    later(work, 10);
    test.mock.timers.tick(10);
    assert.equal(work.mock.callCount(), 1);
  });
});

describe("of several requests", () => {
  it("one is on its way and only the newest waits", async () => {
    const sent = [];
    const release = [];
    const send = latest((value) => {
      sent.push(value);
      return new Promise((resolve) => release.push(resolve));
    });
    const first = send(1);
    for (const value of [2, 3, 4]) send(value);
    assert.deepEqual(sent, [1]);
    release[0]();
    await first;
    assert.deepEqual(sent, [1, 4]);
  });

  it("one that fails does not keep the next one back", async () => {
    const sent = [];
    const send = latest(async (value) => {
      sent.push(value);
      if (value === 1) throw new Error("refused");
    });
    const first = send(1);
    send(2);
    await assert.rejects(first, /refused/);
    assert.deepEqual(sent, [1, 2]);
  });
});
