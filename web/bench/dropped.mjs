/** A page in which a file has been dropped and drawn. */

import { open } from "../tests/browser.mjs";

export { launch } from "../tests/browser.mjs";

/** Milliseconds after which the engine is there, and the programs are compiled, on one processor. */
const START = 4000;

/** Drops a file; gives the page, and the seconds to its first picture. */
export async function dropped(browser, file) {
  const { page } = await open(browser, { viewport: { width: 1280, height: 800 } });
  await page.waitForTimeout(START);
  const start = performance.now();
  const since = () => (performance.now() - start) / 1000;
  await page.setInputFiles("#file", file);
  await page.waitForFunction(() => /^[1-9]/.test(document.querySelector("#drawn").textContent));
  await drawn(page);
  return { page, picture: since(), since };
}

/** Waits until all that the page has asked to be drawn is drawn: reading a pixel takes so long. */
export async function drawn(page) {
  await page.evaluate(() => {
    const gl = document.querySelector("#view").getContext("webgl2");
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
  });
}
