// Bundles the page into the package: `node build.mjs [--watch]`.
import { context, build } from "esbuild";
import { copyFileSync, mkdirSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const here = dirname(fileURLToPath(import.meta.url));
const out = join(here, "..", "src", "tmcm34x", "ide", "static");
mkdirSync(out, { recursive: true });
for (const name of ["index.html", "icon.svg", "theme.js"]) copyFileSync(join(here, "src", name), join(out, name));

const options = {
    entryPoints: { page: join(here, "src", "main.tsx"), style: join(here, "src", "style", "index.css") },
    outdir: out,
    bundle: true,
    format: "esm",
    target: "es2023",
    minify: true,
    jsx: "automatic",
    jsxImportSource: "preact",
    alias: { marked: join(here, "src", "editor", "markdown.ts") },
    legalComments: "none",
    logLevel: "warning",
};

if (process.argv.includes("--watch")) await (await context(options)).watch();
else await build(options);
