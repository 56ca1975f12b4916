/** Seconds from a file's drop to its first picture, and to its curvature, in Chromium: FILE; JSON on stdout. */

import { launch, open, finished } from "../tests/browser.mjs";

const browser = await launch();
const { page } = await open(browser, { viewport: { width: 1280, height: 800 } });
// The engine is there before somebody drops a file.
await page.waitForTimeout(1500);
const start = performance.now();
const since = () => (performance.now() - start) / 1000;
await page.setInputFiles("#file", process.argv[2]);
await page.waitForFunction(() => document.querySelector("#drawn").textContent !== "");
const picture = since();
await finished(page, "mean_curvature");
process.stdout.write(JSON.stringify({ picture, curvature: since() }));
await browser.close();
