import assert from "node:assert/strict";
import { describe, it, mock } from "node:test";

import { ApiError } from "../../frontend_static/shared/api.js";
import { after, later, NewestRequest, throttle } from "../../frontend_static/shared/timing.js";

it("a throttle serves the last request, at most one in an interval, and leaves no timer after its signal", (test) => {
  test.mock.timers.enable({ apis: ["setTimeout"] });
  const [work, end] = [mock.fn(), new AbortController()];
  const ask = throttle(work, 100, end.signal);
  for (const [times, served] of [[5, 1], [1, 2]]) {
    for (let time = 0; time < times; time += 1) ask();
    test.mock.timers.tick(1000);
    assert.equal(work.mock.callCount(), served);
  }
  ask();
  end.abort();
  ask();
  test.mock.timers.tick(1000);
  assert.equal(work.mock.callCount(), 2);
});

it("waiting ends by its signal, by itself, or by its caller", (test) => {
  test.mock.timers.enable({ apis: ["setTimeout"] });
  const [work, never, end] = [mock.fn(), mock.fn(), new AbortController()];
  later(work, 10, end.signal);
  later(work, 10)();
  after(10, end.signal).then(never);
  end.abort();
  later(work, 10, end.signal);
  test.mock.timers.tick(100);
  assert.equal(work.mock.callCount(), 0);
  later(work, 10);
  test.mock.timers.tick(10);
  assert.equal(work.mock.callCount(), 1);
});

describe("what is asked for again and again", () => {
  const turn = () => new Promise((resolve) => setImmediate(resolve));

  /** Who answers when it is told to, remembers what was asked, and tells a page; what a test does not expect there fails it. */
  function stage(on, pause) {
    const [asked, end] = [[], new AbortController()];
    const send = (wish) => new Promise((answer, fail) => asked.push({ wish, answer, fail }));
    const newest = new NewestRequest(send, on, end.signal, pause);
    return { asked, end, newest, wishes: () => asked.map(({ wish }) => wish) };
  }

  it("is one request at a time, and then the newest only", async () => {
    const told = [];
    const { asked, newest, wishes } = stage({ answer: (...answer) => told.push(answer), refused: assert.fail, lost: assert.fail });
    for (let value = 0; value < 100; value += 1) newest.ask(value);
    assert.deepEqual(wishes(), [0]);
    asked[0].answer("first");
    await turn();
    assert.deepEqual(wishes(), [0, 99]);
    asked[1].answer("last");
    await turn();
    assert.deepEqual(told, [["first", 0, false], ["last", 99, true]]);
    newest.ask(5);
    assert.equal(asked.length, 3);
  });

  it("is tried again while the server is gone, with the newest value, and told once", async () => {
    const [lost, pauses] = [[], []];
    const pause = () => new Promise((resolve) => pauses.push(resolve));
    const { asked, newest, wishes } = stage({ answer: () => {}, refused: assert.fail, lost: (is) => lost.push(is) }, pause);
    for (const [wish, time] of [[1, 0], [2, 1]]) {
      newest.ask(wish);
      pauses[time - 1]?.();
      await turn();
      asked[time].fail(new ApiError(0, { message: "The server does not answer" }));
      await turn();
    }
    pauses[1]();
    await turn();
    assert.deepEqual([wishes(), lost], [[1, 2, 2], [true]]);
    asked[2].answer("back");
    await turn();
    assert.deepEqual(lost, [true, false]);
  });

  it("is told when it is refused, and goes on", async () => {
    const refused = [];
    const { asked, newest, wishes } = stage({ answer: () => {}, refused: (_, wish) => refused.push(wish), lost: assert.fail });
    newest.ask(1);
    newest.ask(2);
    asked[0].fail(new ApiError(422, { message: "N must be at most 5, got 9" }));
    await turn();
    assert.deepEqual([refused, wishes()], [[1], [1, 2]]);
  });
});
