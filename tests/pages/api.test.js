import assert from "node:assert/strict";
import { test } from "node:test";

import { addressOf } from "../../frontend_static/shared/api.js";

test("path parameters are encoded and leave the query", () => {
  assert.equal(addressOf("GET uploads/{upload}/truth", { upload: "a/b", experiment: "ball" }), "api/v1/uploads/a%2Fb/truth?experiment=ball");
});

test("undefined and null are not sent, an empty text is", () => {
  assert.equal(addressOf("GET work", { q: "", show: null, limit: undefined }), "api/v1/work?q=");
});

test("a path parameter that would change the route is refused", () => {
  for (const session of ["", ".", ".."]) assert.throws(() => addressOf("GET sessions/{session}", { session }), /Not a valid session/);
});
