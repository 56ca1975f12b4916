/** Seconds from a file's drop to its first picture, and to its curvature, in Chromium: FILE; JSON on stdout. */

import { launch, open, finished } from "../tests/browser.mjs";

const browser = await launch();
const { page } = await open(browser, { viewport: { width: 1280, height: 800 } });
// The engine is there, and the programs are compiled, before somebody drops a file: seconds, on one processor.
await page.waitForTimeout(4000);
const start = performance.now();
const since = () => (performance.now() - start) / 1000;

/** Waits until all that the page has asked to be drawn is drawn: reading a pixel takes so long. */
const drawn = () =>
  page.evaluate(() => {
    const gl = document.querySelector("#view").getContext("webgl2");
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
  });

await page.setInputFiles("#file", process.argv[2]);
await page.waitForFunction(() => /^[1-9]/.test(document.querySelector("#drawn").textContent));
await drawn();
const picture = since();
await finished(page, "mean_curvature");
await drawn();
process.stdout.write(JSON.stringify({ picture, curvature: since() }));
await browser.close();
