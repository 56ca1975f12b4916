/** Seconds to the first picture of a large file, and to the next while the view is turned: FILE; JSON on stdout. */

import { dropped, launch } from "./dropped.mjs";

/** Milliseconds for which the view is turned. */
const TURNING = 4000;

const browser = await launch();
const { page, picture } = await dropped(browser, process.argv[2]);
await page.waitForFunction(() => document.querySelector("#progress").hidden);
await page.evaluate(() => {
  const element = document.querySelector("#drawn");
  window.frames = [];
  const note = () => window.frames.push([performance.now(), element.textContent]);
  new MutationObserver(note).observe(element, { childList: true });
});
await page.mouse.move(400, 400);
await page.mouse.down();
const start = performance.now();
for (let step = 0; performance.now() - start < TURNING; step++) {
  await page.mouse.move(400 + ((3 * step) % 300), 400 + (step % 40));
}
await page.mouse.up();
const frames = await page.evaluate(() => window.frames);
const [first, last] = [frames[0], frames.at(-1)];
const frame = (last[0] - first[0]) / (frames.length - 1) / 1000;
process.stdout.write(JSON.stringify({ picture, frame, drawn: parseInt(last[1].replaceAll(",", "")) }));
await browser.close();
