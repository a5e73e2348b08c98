import assert from "node:assert/strict";
import { describe, it } from "node:test";

import { ApiError } from "../../frontend_static/shared/api.js";
import { NewestRequest } from "../../frontend_static/shared/timing.js";

describe("what is asked for again and again", () => {
  /** Who answers when it is told to, and remembers what was asked. */
  function server() {
    /** @type {{wish: number, answer: (value: unknown) => void, fail: (error: Error) => void}[]} */
    const asked = [];
    const send = (/** @type {number} */ wish) => new Promise((answer, fail) => asked.push({ wish, answer, fail }));
    return { asked, send };
  }

  const turn = () => new Promise((resolve) => setImmediate(resolve));

  it("is one request at a time, and then the newest only", async () => {
    const { asked, send } = server();
    /** @type {[unknown, number, boolean][]} */
    const told = [];
    const newest = new NewestRequest(send, {
      answer: (answer, wish, isNewest) => told.push([answer, wish, isNewest]),
      refused: assert.fail,
      lost: assert.fail,
    }, new AbortController().signal);
    for (let value = 0; value < 100; value += 1) newest.ask(value);
    assert.deepEqual(asked.map(({ wish }) => wish), [0]);
    asked[0].answer("first");
    await turn();
    assert.deepEqual(asked.map(({ wish }) => wish), [0, 99]);
    asked[1].answer("last");
    await turn();
    assert.deepEqual(told, [["first", 0, false], ["last", 99, true]]);
    newest.ask(5);
    assert.equal(asked.length, 3);
  });

  it("is tried again while the server is gone, with the newest value, and told once", async () => {
    const { asked, send } = server();
    /** @type {boolean[]} */
    const lost = [];
    const pauses = /** @type {(() => void)[]} */ ([]);
    const pause = () => new Promise((resolve) => pauses.push(() => resolve(undefined)));
    const newest = new NewestRequest(send, { answer: () => {}, refused: assert.fail, lost: (is) => lost.push(is) }, new AbortController().signal, pause);
    const gone = new ApiError(0, { message: "The server does not answer" });
    newest.ask(1);
    asked[0].fail(gone);
    await turn();
    newest.ask(2);
    pauses[0]();
    await turn();
    asked[1].fail(gone);
    await turn();
    pauses[1]();
    await turn();
    assert.deepEqual([asked.map(({ wish }) => wish), lost], [[1, 2, 2], [true]]);
    asked[2].answer("back");
    await turn();
    assert.deepEqual(lost, [true, false]);
  });

  it("is told when it is refused, and goes on", async () => {
    const { asked, send } = server();
    /** @type {number[]} */
    const refused = [];
    const newest = new NewestRequest(send, { answer: () => {}, refused: (_, wish) => refused.push(wish), lost: assert.fail }, new AbortController().signal);
    newest.ask(1);
    newest.ask(2);
    asked[0].fail(new ApiError(422, { message: "N must be at most 5, got 9" }));
    await turn();
    assert.deepEqual([refused, asked.map(({ wish }) => wish)], [[1], [1, 2]]);
  });

  it("is neither sent nor told once the page is gone", async () => {
    const { asked, send } = server();
    const end = new AbortController();
    const newest = new NewestRequest(send, { answer: assert.fail, refused: assert.fail, lost: assert.fail }, end.signal);
    newest.ask(1);
    newest.ask(2);
    end.abort();
    asked[0].answer("too late");
    await turn();
    assert.equal(asked.length, 1);
  });

  it("is joined with what waits where nothing of that may be lost, and resolves when all is answered", async () => {
    const { asked, send } = server();
    const newest = new NewestRequest(send, { join: (waiting, newer) => ({ ...waiting, ...newer }) }, new AbortController().signal);
    newest.ask({ a: 1 });
    newest.ask({ a: 2 });
    const all = newest.ask({ b: 3 });
    asked[0].answer();
    await turn();
    assert.deepEqual(asked.map(({ wish }) => wish), [{ a: 1 }, { a: 2, b: 3 }]);
    asked[1].answer();
    await all;
  });

  it("is thrown at who asked where nobody hears of refusals, and what waits is sent nevertheless", async () => {
    const { asked, send } = server();
    const newest = new NewestRequest(send, {}, new AbortController().signal);
    const first = newest.ask(1);
    newest.ask(2);
    asked[0].fail(new Error("refused"));
    await assert.rejects(first, /refused/);
    assert.deepEqual(asked.map(({ wish }) => wish), [1, 2]);
  });
});
