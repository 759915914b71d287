// Makes scenelang/play/web/codemirror.js of the packages that package-lock.json names, and the file of their licences.
//   npm ci && node build.mjs
import { createHash } from "node:crypto";
import { readFileSync, readdirSync, writeFileSync } from "node:fs";
import { build } from "esbuild";

const TARGET = "../../scenelang/play/web/codemirror";
const digest = (text) => createHash("sha256").update(text).digest("hex");

const { outputFiles: [made], metafile } = await build({
  entryPoints: ["codemirror.js"],
  bundle: true,
  minify: true,
  format: "esm",
  target: "es2022",
  legalComments: "none",
  metafile: true,
  write: false,
  logLevel: "warning",
});

const inside = Object.values(metafile.outputs)[0].inputs;  // what tree shaking left something of
const names = new Set(
  Object.entries(inside)
    .filter(([path, { bytesInOutput }]) => path.startsWith("node_modules/") && bytesInOutput > 0)
    .map(([path]) => path.match(/^node_modules\/((?:@[^/]+\/)?[^/]+)/)[1]),
);
const packages = [...names].sort().map((name) => {
  const folder = `node_modules/${name}`;
  const licence = readdirSync(folder).find((file) => /^licen[cs]e/i.test(file));
  if (!licence) throw new Error(`${name} has no licence file`);
  const { version, license } = JSON.parse(readFileSync(`${folder}/package.json`, "utf8"));
  return { name, version, license, text: readFileSync(`${folder}/${licence}`, "utf8").trim() };
});

const lock = digest(readFileSync("package-lock.json", "utf8"));
const entry = digest(readFileSync("codemirror.js", "utf8"));
const head = [
  "/* CodeMirror 6, made by editors/playground/build.mjs; licences: codemirror.LICENSE.txt",
  ...packages.map(({ name, version }) => `   ${name} ${version}`),
  `   package-lock.json ${lock}`,
  `   codemirror.js ${entry}`,
  `   code ${digest(made.text)} */`,
];
writeFileSync(`${TARGET}.js`, `${head.join("\n")}\n${made.text}`);

const licences = packages.map(({ name, version, license, text }) => `${name} ${version} (${license})\n\n${text}\n`);
writeFileSync(`${TARGET}.LICENSE.txt`, licences.join(`\n${"-".repeat(80)}\n\n`));
console.log(`${packages.length} packages, ${made.contents.length} bytes`);
