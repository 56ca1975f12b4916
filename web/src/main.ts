/** Starts the page: empty, with a file that a server has, or with a report's data. */

import { Application } from "./app.js";
import { Engine } from "./engine/client.js";
import { readReport } from "./report_data.js";
import { unpack } from "./unpack.js";

async function startEngine(): Promise<Engine> {
  const [worker, engine] = await Promise.all([unpack("packed-worker"), unpack("packed-engine")]);
  const script = URL.createObjectURL(new Blob([worker], { type: "text/javascript" }));
  return new Engine(script, engine);
}

async function start(): Promise<void> {
  const root = document.getElementById("app") as HTMLElement;
  const application = new Application(root, startEngine());
  const report = document.getElementById("report-data")?.textContent ?? "";
  const source = document.getElementById("source-data")?.textContent ?? "";
  if (report !== "") application.openReport(await readReport(report));
  else if (source !== "") await application.openSource(JSON.parse(source) as { url: string; name: string });
  else application.openLink();
}

void start();
