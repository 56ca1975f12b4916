/** Builds the core for WebAssembly, with what compiler there is, into dist/engine.wasm. */

import { execFileSync, spawnSync } from "node:child_process";
import { existsSync, mkdirSync, readFileSync } from "node:fs";
import path from "node:path";
import { fileURLToPath } from "node:url";

const TARGET = "wasm32-unknown-unknown";
/** Debian's compiler, and the sources of its standard library. */
const DEBIAN = { rustc: "/usr/bin/rustc", sources: "/usr/lib/rustlib/src/rust/library/std" };
const web = path.dirname(fileURLToPath(import.meta.url));
const root = path.dirname(web);

const output = (command, ...args) => spawnSync(command, args, { encoding: "utf8" }).stdout?.trim() ?? "";
const succeeds = (command, ...args) => spawnSync(command, args, { stdio: "ignore" }).status === 0;

/** The compiler, its flags, and the linker; null where none can do it. */
function toolchain() {
  const host = /host: (\S+)/.exec(output("rustc", "-vV"))?.[1];
  const bundled = path.join(output("rustc", "--print", "sysroot"), "lib/rustlib", host ?? "", "bin/rust-lld");
  const linker = existsSync(bundled)
    ? [bundled, "-flavor", "wasm"]
    : succeeds("wasm-ld", "--version")
      ? ["wasm-ld"]
      : null;
  if (linker !== null && succeeds("rustup", "target", "add", TARGET)) {
    return { env: {}, flags: [], linker };
  }
  // Debian's rustc for the web, and the standard library's sources, of which it is then built.
  if (existsSync(DEBIAN.rustc) && existsSync(DEBIAN.sources) && linker !== null) {
    const env = { RUSTC: DEBIAN.rustc, RUSTC_BOOTSTRAP: "1" };
    return { env, flags: ["-Z", "build-std=std,panic_abort"], linker };
  }
  return null;
}

const found = toolchain();
if (found === null) {
  process.stderr.write(
    `the engine needs Rust's target ${TARGET}: install rustup (https://rustup.rs), which fetches it, ` +
      "or Debian's packages cargo-web, rustc-web, rust-web-src and lld\n",
  );
  process.exit(3);
}
const env = { ...process.env, ...found.env, RUSTFLAGS: "-C target-feature=+simd128", CARGO_INCREMENTAL: "0" };
const build = ["rustc", "--profile", "page", "--package", "surfsig-c", "--lib", "--crate-type", "staticlib"];
execFileSync("cargo", [...build, "--target", TARGET, ...found.flags], { cwd: root, env, stdio: "inherit" });

const exported = readFileSync(path.join(web, "engine_exports.txt"), "utf8").trim().split("\n");
const library = path.join(root, "target", TARGET, "page", "libsurfsig_c.a");
mkdirSync(path.join(web, "dist"), { recursive: true });
const [linker, ...flavor] = found.linker;
execFileSync(
  linker,
  [
    ...flavor,
    "--no-entry",
    "--gc-sections",
    "--strip-all",
    // Progress functions are put into the table.
    "--export-table",
    "--growable-table",
    "--stack-first",
    "-z",
    "stack-size=1048576",
    ...exported.map((name) => `--export=${name}`),
    library,
    "-o",
    path.join(web, "dist", "engine.wasm"),
  ],
  { stdio: "inherit" },
);
