import assert from "node:assert/strict";
import { afterEach, beforeEach, describe, it } from "node:test";

import { request } from "../../frontend_static/shared/api.js";
import { whenCompiled } from "../../frontend_static/shared/compiling.js";

const REFUSED = () => globalThis.Response.json({ error: { message: "not ready" } }, { status: 503 });
const fetched = globalThis.fetch;

/** @param {() => {finished: boolean, ready: string[]}} progress */
function answerWith(progress) {
  globalThis.fetch = async (address) => (String(address).endsWith("compilation") ? globalThis.Response.json({ sentence: "compiling", ...progress() }) : REFUSED());
}

describe("an experiment that has to be compiled first", () => {
  beforeEach(() => answerWith(() => ({ finished: false, ready: ["ball"] })));
  afterEach(() => (globalThis.fetch = fetched));

  it("is begun again when it became ready just after the server had refused it", async () => {
    let tries = 0;
    const act = () => ((tries += 1) === 1 ? request("GET sessions") : Promise.resolve("begun"));
    assert.equal(await whenCompiled("ball", act, () => {}, new AbortController().signal), "begun");
  });

  it("is refused for another reason if it is ready and refused all the same", async () => {
    let tries = 0;
    const act = () => {
      tries += 1;
      return request("GET sessions");
    };
    await assert.rejects(whenCompiled("ball", act, () => {}, new AbortController().signal), /not ready/);
    assert.equal(tries, 2);
  });

  it("is not begun for somebody who has left meanwhile, and nothing is said any more", async () => {
    const end = new AbortController();
    answerWith(() => {
      end.abort();
      return { finished: false, ready: [] };
    });
    let tries = 0;
    const act = () => {
      tries += 1;
      return request("GET sessions");
    };
    await assert.rejects(whenCompiled("ball", act, () => assert.fail("nobody is there"), end.signal), /not ready/);
    assert.equal(tries, 1);
  });
});

describe("a request", () => {
  afterEach(() => (globalThis.fetch = fetched));

  it("says in words that the connection broke in the middle of the answer", async () => {
    const broken = new globalThis.ReadableStream({ start: (controller) => controller.error(new TypeError("network error")) });
    globalThis.fetch = async () => new globalThis.Response(broken);
    await assert.rejects(request("GET runs"), /The server does not answer/);
  });
});
