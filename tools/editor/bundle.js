/**
 * Bundle CodeMirror for the page's editor: `npm ci && npm run bundle` in this folder. The pages have no other build step, and
 * this one is needed only for another version; its result and its licences are part of the sources.
 */

import { readFile, writeFile } from "node:fs/promises";
import { build } from "esbuild";

const FOLDER = "../../frontend_static/vendor";

const { metafile } = await build({
  entryPoints: ["codemirror.js"],
  bundle: true,
  format: "esm",
  minify: true,
  legalComments: "none",
  metafile: true,
  outfile: `${FOLDER}/codemirror.js`,
});
const packages = new Set(Object.keys(metafile.inputs).flatMap((path) => path.match(/node_modules\/((?:@[^/]+\/)?[^/]+)\//)?.[1] ?? []));
const licences = await Promise.all(
  [...packages].sort().map(async (name) => {
    const { version, license } = JSON.parse(await readFile(`node_modules/${name}/package.json`, "utf8"));
    const text = await readFile(`node_modules/${name}/LICENSE`, "utf8");
    return `${name} ${version} (${license})\n\n${text.trim()}\n`;
  }),
);
await writeFile(`${FOLDER}/LICENSES.txt`, `codemirror.js was bundled from these packages.\n\n${licences.join("\n---\n\n")}`);
