/** The only script that the page has as it stands: unpacks the others, or says why it cannot. */

import { unpack } from "./unpack.js";

async function start(): Promise<void> {
  if (typeof DecompressionStream === "undefined") {
    throw new Error("this browser is too old: Chrome 103, Firefox 113, Safari 16.4 or later is needed");
  }
  const script = document.createElement("script");
  script.textContent = new TextDecoder().decode(await unpack("packed-page"));
  document.body.append(script);
}

start().catch((error: Error) => {
  document.body.textContent = error.message;
});
