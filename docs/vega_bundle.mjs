// Makes the script that draws the figures of pages, and the licences of all packages in it:
//
//     npm install esbuild vega vega-lite vega-embed
//     node docs/vega_bundle.mjs
//
// in the top folder of a checkout. It writes src/rbstab/report/writers/vega/bundle.js.gz and THIRD_PARTY_LICENSES.

import { build } from "esbuild";
import { readFileSync, readdirSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { gzipSync } from "node:zlib";

const { outputFiles, metafile } = await build({
  stdin: { contents: 'import embed from "vega-embed"; window.vegaEmbed = embed;', resolveDir: process.cwd() },
  bundle: true,
  minify: true,
  format: "iife",
  legalComments: "none",
  metafile: true,
  write: false,
});
writeFileSync("src/rbstab/report/writers/vega/bundle.js.gz", gzipSync(outputFiles[0].contents, { level: 9 }));

const folders = new Set();
for (const path of Object.keys(metafile.inputs)) {
  const found = /^(.*node_modules\/(?:@[^/]+\/)?[^/]+)\//.exec(path);
  if (found) folders.add(found[1]);
}
// d3-delaunay comes with these inside.
for (const name of ["delaunator", "robust-predicates"]) folders.add(join("node_modules", name));
const sections = [...folders].sort().map((folder) => {
  const { name, version, license } = JSON.parse(readFileSync(join(folder, "package.json"), "utf8"));
  const file = readdirSync(folder).find((one) => /^licen[cs]e/i.test(one));
  if (!file) throw new Error(`${folder} has no licence file`);
  return `${name} ${version} (${license})\n\n${readFileSync(join(folder, file), "utf8").trim()}\n`;
});
const head = "The HTML reports of rbstab contain a script (src/rbstab/report/writers/vega/bundle.js.gz) made of these packages.\n";
writeFileSync("THIRD_PARTY_LICENSES", [head, ...sections].join(`\n${"-".repeat(80)}\n\n`));
