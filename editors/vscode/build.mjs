// Bundles the client into dist/ and takes the grammar from the repository's grammar/ folder, where it is kept.
//   node build.mjs [--minify]     node build.mjs grammar
import { copyFileSync, mkdirSync } from "node:fs";

mkdirSync("syntaxes", { recursive: true });
copyFileSync("../../grammar/scenelang.tmLanguage.json", "syntaxes/scenelang.tmLanguage.json");
copyFileSync("../../LICENSE", "LICENSE.txt");

if (!process.argv.includes("grammar")) {
  const { build } = await import("esbuild");
  await build({
    entryPoints: ["src/extension.js"],
    outfile: "dist/extension.js",
    bundle: true,
    platform: "node",
    format: "cjs",
    target: "node18",
    external: ["vscode"],
    minify: process.argv.includes("--minify"),
    sourcemap: !process.argv.includes("--minify"),
    logLevel: "warning",
  });
}
