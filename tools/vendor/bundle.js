/**
 * Bundle the libraries of the pages: `npm ci && npm run bundle` in this folder. The pages have no other build step, and this
 * one is needed only for another version; its results, their licences and their hashes are part of the sources.
 */

import { createHash } from "node:crypto";
import { readFile, writeFile } from "node:fs/promises";
import { build } from "esbuild";

const FOLDER = "../../frontend_static/vendor";

const locked = JSON.parse(await readFile("package-lock.json", "utf8")).packages;
const hashes = {};
const bundled = new Set();
for (const name of ["codemirror.js", "preact.js"]) {
  const outfile = `${FOLDER}/${name}`;
  const { metafile } = await build({ entryPoints: [name], bundle: true, format: "esm", minify: true, legalComments: "none", metafile: true, outfile });
  for (const path of Object.keys(metafile.inputs)) {
    const found = path.match(/^node_modules\/(?:@[^/]+\/)?[^/]+/);
    if (found) bundled.add(found[0]);
  }
  hashes[name] = createHash("sha256").update(await readFile(outfile)).digest("hex");
}
const packages = [...bundled].sort();
const licences = await Promise.all(
  packages.map(async (path) => {
    const { name, version, license } = JSON.parse(await readFile(`${path}/package.json`, "utf8"));
    const text = await readFile(`${path}/LICENSE`, "utf8");
    return `${name} ${version} (${license})\n\n${text.trim()}\n`;
  }),
);
await writeFile(`${FOLDER}/LICENSES.txt`, `The libraries in this folder were bundled from these packages.\n\n${licences.join("\n---\n\n")}`);
const sources = Object.fromEntries(packages.map((path) => [path.replace("node_modules/", ""), locked[path].integrity]));
await writeFile(`${FOLDER}/hashes.json`, `${JSON.stringify({ files: hashes, packages: sources }, null, 1)}\n`);
