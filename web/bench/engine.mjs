/** Processor time of the engine in V8, without a browser: node bench/engine.mjs POINTS.f32 RADIUS; JSON on stdout. */

import { readFileSync } from "node:fs";
import path from "node:path";
import { fileURLToPath } from "node:url";
import { gunzipSync } from "node:zlib";
import { build } from "esbuild";

const web = path.dirname(path.dirname(fileURLToPath(import.meta.url)));
const [file, radius] = process.argv.slice(2);

const entry = 'export { EngineModule } from "./module.js"; export { EngineCloud } from "./surfsig.js";';
const { outputFiles } = await build({
  stdin: { contents: entry, resolveDir: path.join(web, "src", "engine") },
  bundle: true,
  write: false,
  format: "esm",
});
const source = Buffer.from(outputFiles[0].contents).toString("base64");
const { EngineModule, EngineCloud } = await import(`data:text/javascript;base64,${source}`);

/** The engine of the page that is in the package. */
function packedEngine() {
  const page = readFileSync(path.join(web, "..", "python", "surfsig", "page", "viewer.html"), "utf8");
  return gunzipSync(Buffer.from(/id="packed-engine">([^<]*)</.exec(page)[1], "base64"));
}

const bytes = readFileSync(file);
const points = new Float32Array(bytes.buffer, bytes.byteOffset, bytes.length / 4);
const cloud = new EngineCloud(await EngineModule.load(packedEngine()), points, [0, 0, 0], null);

/** Seconds of this process's processor that some work takes. */
function seconds(work) {
  const before = process.cpuUsage();
  work();
  const { user, system } = process.cpuUsage(before);
  return (user + system) / 1e6;
}

let count;
const extract = () => ({ count } = cloud.extract(Number(radius), null, () => true));
const [first, second, third] = [extract, extract, extract].map(seconds);
const neighbours = count.reduce((sum, n) => sum + n, 0) / count.length;
process.stdout.write(JSON.stringify({ first, again: Math.min(second, third), neighbours }));
