/** Builds the page: one file that needs nothing else. `node build.mjs` builds the engine too where it is missing. */

import { createHash } from "node:crypto";
import { mkdirSync, readFileSync, readdirSync, writeFileSync } from "node:fs";
import path from "node:path";
import { fileURLToPath } from "node:url";
import { gzipSync } from "node:zlib";
import { build } from "esbuild";

const web = path.dirname(fileURLToPath(import.meta.url));
const kept = path.join(path.dirname(web), "python", "surfsig", "page", "viewer.html");

async function bundled(entry) {
  const { outputFiles } = await build({
    entryPoints: [path.join(web, "src", entry)],
    bundle: true,
    minify: true,
    write: false,
    format: "iife",
    target: "es2022",
    loader: { ".wasm": "binary" },
    legalComments: "none",
    logLevel: "warning",
  });
  return outputFiles[0].contents;
}

/** Hash of all that the page is made of, but for the engine; tests/test_page_built.py takes it again. */
function sourcesHash() {
  const hash = createHash("sha256");
  const folder = path.join(web, "src");
  const files = readdirSync(folder, { recursive: true, withFileTypes: true })
    .filter((entry) => entry.isFile())
    .map((entry) => path.relative(web, path.join(entry.parentPath, entry.name)).split(path.sep).join("/"));
  for (const file of [...files, "package-lock.json", "engine_exports.txt", "build.mjs"].sort()) {
    hash
      .update(file)
      .update("\0")
      .update(readFileSync(path.join(web, file), "utf8").replaceAll("\r\n", "\n"));
  }
  return hash.digest("hex");
}

/** gzip in base64, always of the same bytes. */
const packed = (bytes) => gzipSync(bytes, { level: 9 }).toString("base64");

const [page, worker, unpack] = await Promise.all(
  ["main.ts", "engine/worker.ts", "unpack_page.ts"].map(bundled),
);
const parts = {
  sources: sourcesHash(),
  style: readFileSync(path.join(web, "src", "style.css"), "utf8"),
  engine: packed(readFileSync(path.join(web, "dist", "engine.wasm"))),
  worker: packed(worker),
  page: packed(page),
  unpack: new TextDecoder().decode(unpack).trim(),
};
const template = readFileSync(path.join(web, "src", "page.html"), "utf8");
const html = template.replace(/\{\{(\w+)\}\}/g, (_, name) => parts[name]);
mkdirSync(path.dirname(kept), { recursive: true });
for (const file of [path.join(web, "dist", "index.html"), kept]) writeFileSync(file, html);
process.stdout.write(
  `page: ${(html.length / 1e6).toFixed(2)} MB, ${(gzipSync(html, { level: 9 }).length / 1e6).toFixed(2)} MB compressed ` +
    `(engine ${parts.engine.length}, worker ${parts.worker.length}, page ${parts.page.length})\n`,
);
