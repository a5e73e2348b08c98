import assert from "node:assert/strict";
import { readFileSync, readdirSync } from "node:fs";
import { describe, it } from "node:test";

const FOLDERS = ["frontend_static/", "server/pftrack_server/viewer/client/"].map((path) => new URL(`../../${path}`, import.meta.url));

/** The types that comments name: what stands in braces behind a tag, but for the `object` that properties describe. */
function typesOf(text) {
  const found = [];
  for (const tag of text.matchAll(/@(param|property|returns|type|typedef|extends|template|this|throws|satisfies) \{/g)) {
    const start = tag.index + tag[0].length;
    let end = start;
    for (let depth = 1; depth > 0; end += 1) depth += { "{": 1, "}": -1 }[text[end]] ?? 0;
    const type = text.slice(start, end - 1);
    if (!(tag[1] === "typedef" && type === "object")) found.push(type);
  }
  return found;
}

describe("the types in the scripts' comments", () => {
  for (const folder of FOLDERS) {
    for (const name of readdirSync(folder, { recursive: true }).filter((path) => /\.(js|d\.ts)$/.test(path))) {
      it(`say something in ${name}`, () => {
        const text = readFileSync(new URL(name, folder), "utf8");
        const vague = typesOf(text).filter((type) => /\b(any|object|Object|Function)\b|^\*$/.test(type));
        assert.deepEqual(vague, []);
        if (name.endsWith(".d.ts")) assert.doesNotMatch(text, /[:<|] *any\b/);
        for (const comment of text.matchAll(/(?:@ts-(?:ignore|expect-error|nocheck)|eslint-disable)(.*)/g)) assert.match(comment[1], /- \w+/);
      });
    }
  }
});
