/** Seconds from a file's drop to its first picture, and to its curvature, in Chromium: FILE; JSON on stdout. */

import { finished } from "../tests/browser.mjs";
import { drawn, dropped, launch } from "./dropped.mjs";

const browser = await launch();
const { page, picture, since } = await dropped(browser, process.argv[2]);
await finished(page, "mean_curvature");
await drawn(page);
process.stdout.write(JSON.stringify({ picture, curvature: since() }));
await browser.close();
