import assert from "node:assert/strict";
import { describe, it, mock } from "node:test";

import { after, later, throttle } from "../../frontend_static/shared/timing.js";

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
