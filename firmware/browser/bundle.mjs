// node bundle.mjs WORK PAGE: what build.py has made, and the scripts of this folder, as one file.
import { build } from "esbuild";
import { readFileSync, readdirSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { dispatch } from "./dispatch.mjs";
import { bytesOf } from "./hex.mjs";

const [work, page] = process.argv.slice(2);
const here = dirname(fileURLToPath(import.meta.url));

for (const name of readdirSync(work).filter((name) => name.endsWith(".hex"))) {
  const text = readFileSync(join(work, name), "latin1");
  writeFileSync(join(work, name.replace(/hex$/, "bin")), bytesOf(text));
}

async function bundle(entry) {
  const made = await build({
    entryPoints: [join(here, entry)],
    bundle: true,
    minify: true,
    write: false,
    format: "iife",
    target: "es2020",
    alias: { made: work },
    loader: { ".bin": "binary", ".wasm": "binary", ".txt": "text" },
    logLevel: "warning",
    plugins: [dispatch],
  });
  return made.outputFiles[0].text;
}

writeFileSync(join(work, "worker.txt"), await bundle("worker.mjs"));
// In a script "</script" would end it.
const script = (await bundle("page.mjs")).replaceAll("</script", "<\\/script");
const license = readFileSync(join(here, "node_modules/avr8js/LICENSE"), "utf8");

const parts = {
  style: readFileSync(join(here, "page.css"), "utf8"),
  script,
  license: `avr8js, of which the chip's core is:\n\n${license}`.replaceAll("--", "- -"),
};
const template = readFileSync(join(here, "page.html"), "utf8");
const whole = template.replace(/\{\{(\w+)\}\}/g, (_, part) => parts[part]);
writeFileSync(page, whole);
