import assert from "node:assert/strict";
import { afterEach, beforeEach, describe, it } from "node:test";

import { addressOf, request } from "../../frontend_static/shared/api.js";
import { whenCompiled } from "../../frontend_static/shared/compiling.js";

const { fetch, ReadableStream, Response } = globalThis;

afterEach(() => (globalThis.fetch = fetch));

describe("the address of a request", () => {
  for (const [what, route, parameters, address] of [
    ["encodes path parameters, which leave the query", "GET uploads/{upload}/truth", { upload: "a/b", experiment: "ball" }, "uploads/a%2Fb/truth?experiment=ball"],
    ["has an empty text, and neither undefined nor null", "GET work", { q: "", show: null, limit: undefined }, "work?q="],
  ]) it(what, () => assert.equal(addressOf(route, parameters), `api/v1/${address}`));

  it("is refused where a path parameter would change the route", () => {
    for (const session of ["", ".", ".."]) assert.throws(() => addressOf("GET sessions/{session}", { session }), /Not a valid session/);
  });
});

it("a request says in words that the connection broke in the middle of the answer", async () => {
  globalThis.fetch = async () => new Response(new ReadableStream({ start: (controller) => controller.error(new TypeError("network error")) }));
  await assert.rejects(request("GET runs"), /The server does not answer/);
});

describe("an experiment that has to be compiled first", () => {
  let end, ready, tries;
  beforeEach(() => {
    [end, ready, tries] = [new AbortController(), () => ["ball"], 0];
    const refused = () => Response.json({ error: { message: "not ready" } }, { status: 503 });
    const progress = () => Response.json({ sentence: "compiling", finished: false, ready: ready() });
    globalThis.fetch = async (address) => (String(address).endsWith("compilation") ? progress() : refused());
  });
  /** Begin the experiment, which is refused so many times. */
  const begin = (refusals, tell = () => {}) =>
    whenCompiled("ball", () => ((tries += 1) <= refusals ? request("GET sessions") : Promise.resolve("begun")), tell, end.signal);

  it("is begun again when it became ready just after the server had refused it", async () => assert.equal(await begin(1), "begun"));

  it("is refused for another reason if it is ready and refused all the same", async () => {
    await assert.rejects(begin(Infinity), /not ready/);
    assert.equal(tries, 2);
  });

  it("is not begun for somebody who has left meanwhile, and nothing is said any more", async () => {
    ready = () => {
      end.abort();
      return [];
    };
    await assert.rejects(begin(Infinity, () => assert.fail("nobody is there")), /not ready/);
    assert.equal(tries, 1);
  });
});
