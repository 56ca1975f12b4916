/** A browser without a window, the page in it, and what tests do there. */

import { spawnSync } from "node:child_process";
import { existsSync, mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import path from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";
import { chromium } from "playwright-core";

const here = path.dirname(fileURLToPath(import.meta.url));
const root = path.dirname(path.dirname(here));

/** The page as the package has it. */
export const PAGE = path.join(root, "python", "surfsig", "page", "viewer.html");

/** Where screenshots are kept to be looked at; a folder that goes where nobody names one. */
export const PICTURES = process.env.SURFSIG_PICTURES ?? null;

const PYTHON = process.env.PYTHON ?? path.join(root, ".venv", "bin", "python");

/** Milliseconds that any computation may take on a slow machine. */
const PATIENCE = 120_000;

/** Why there are no tests here; null where there are. */
export function missing() {
  if (browserPath() === undefined) return "CHROMIUM names no browser (`make test-web` looks for one)";
  if (!existsSync(PAGE)) return "the page has not been built (make page)";
  if (!existsSync(PYTHON)) return `there is no ${PYTHON}, whose values are compared`;
  return null;
}

function browserPath() {
  const file = process.env.CHROMIUM;
  return file !== undefined && existsSync(file) ? file : undefined;
}

export function launch() {
  // Pixels by the processor: the same on every machine.
  const drawing = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"];
  return chromium.launch({ executablePath: browserPath(), args: ["--no-sandbox", ...drawing] });
}

/** Runs the reference with some arguments; gives what it prints as JSON. */
export function reference(...args) {
  const env = { ...process.env, PYTHONPATH: path.join(root, "python") };
  const done = spawnSync(PYTHON, [path.join(here, "reference.py"), ...args.map(String)], {
    env,
    encoding: "utf8",
  });
  if (done.status !== 0) throw new Error(done.stderr);
  return JSON.parse(done.stdout);
}

/** A folder for files of a test, taken away at its end. */
export function folder(test) {
  const made = mkdtempSync(path.join(tmpdir(), "surfsig-page-"));
  test.after(() => rmSync(made, { recursive: true, force: true }));
  return made;
}

/** A new page, whose errors and requests to elsewhere fail the test. */
export async function open(browser, options = {}, address = pathToFileURL(PAGE).href) {
  const page = await browser.newPage({ viewport: { width: 860, height: 560 }, ...options });
  const wrong = [];
  page.on("pageerror", (error) => wrong.push(error.message));
  page.on("request", (request) => {
    if (!/^(file|blob|data):|^http:\/\/127\.0\.0\.1:/.test(request.url()))
      wrong.push(`asked for ${request.url()}`);
  });
  page.setDefaultTimeout(PATIENCE);
  await page.goto(address);
  return { page, wrong };
}

/** Waits until nothing runs and the points are coloured by something. */
export async function finished(page, quantity = null) {
  await page.waitForFunction((wanted) => {
    const [running, chosen] = [document.querySelector("#progress"), document.querySelector("#quantity")];
    const known =
      wanted === null ? chosen?.value !== "height" && chosen?.value !== "file" : chosen?.value === wanted;
    return running?.hidden === true && known;
  }, quantity);
}

export async function openSample(page, id) {
  await page.click(`[data-sample=${id}]`);
  await finished(page, "mean_curvature");
}

/** Clicks a button that saves, and keeps the file. */
export async function saved(page, button, file) {
  const [download] = await Promise.all([page.waitForEvent("download"), page.click(button)]);
  await download.saveAs(file);
  return file;
}

export async function picture(page, name) {
  if (PICTURES !== null) await page.screenshot({ path: path.join(PICTURES, `${name}.png`) });
}
