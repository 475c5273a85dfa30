// Runs the unit tests under test/ with Node's own test runner, bundled by esbuild.
import { build } from "esbuild";
import { spawnSync } from "node:child_process";
import { mkdtempSync, readdirSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const here = dirname(fileURLToPath(import.meta.url));
const out = mkdtempSync(join(tmpdir(), "tmcm34x-test-"));
try {
    const tests = readdirSync(join(here, "test")).filter(name => name.endsWith(".test.ts"));
    await build({
        entryPoints: tests.map(name => join(here, "test", name)),
        outdir: out,
        bundle: true,
        platform: "node",
        format: "esm",
        outExtension: { ".js": ".mjs" },
        logLevel: "warning",
    });
    const { status } = spawnSync(
        process.execPath,
        ["--test", ...tests.map(name => join(out, name.replace(/ts$/, "mjs")))],
        { stdio: "inherit" },
    );
    process.exitCode = status ?? 1;
} finally {
    rmSync(out, { recursive: true });
}
