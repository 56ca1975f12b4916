/** The worker: reads files, and runs the core, one request after another. */

import { readCloud } from "../files/read.js";
import type { Answer, Request, Results } from "./messages.js";
import { EngineError, EngineModule } from "./module.js";
import { EngineCloud } from "./surfsig.js";

/** Milliseconds between two reports of progress. */
const REPORT_INTERVAL = 50;

let engine: EngineModule | null = null;
let cloud: EngineCloud | null = null;

function send(answer: Answer, transfer: Transferable[] = []): void {
  self.postMessage(answer, { transfer });
}

/** A progress function that tells the page, not too often. */
function reporter(id: number): (done: number, total: number) => boolean {
  let last = 0;
  return (done, total) => {
    const now = performance.now();
    if (now - last >= REPORT_INTERVAL) {
      last = now;
      send({ id, progress: total > 0 ? Math.min(done / total, 1) : 0 });
    }
    return true;
  };
}

function loadedCloud(): EngineCloud {
  if (cloud === null) throw new EngineError("no cloud has been loaded");
  return cloud;
}

async function work(id: number, request: Request): Promise<Results[keyof Results]> {
  switch (request.kind) {
    case "start":
      engine = await EngineModule.load(request.engine);
      return null;
    case "read":
      return readCloud(request.name, request.bytes);
    case "load":
      if (engine === null) throw new EngineError("the engine has not been started");
      cloud = new EngineCloud(engine, request.positions, request.origin, request.viewpoint);
      return { spacing: cloud.spacing() };
    case "extract":
      return loadedCloud().extract(request.radius, request.indices, reporter(id));
    case "similarities":
      return loadedCloud().similarities(request.query);
    case "surfaces":
      return loadedCloud().findSurfaces(reporter(id));
  }
}

/** The buffers of a result, which need no copy on their way. */
function buffers(result: unknown): Transferable[] {
  if (ArrayBuffer.isView(result)) return [result.buffer as ArrayBuffer];
  if (result === null || typeof result !== "object") return [];
  return [
    ...new Set(Object.values(result).flatMap((value) => (ArrayBuffer.isView(value) ? buffers(value) : []))),
  ];
}

/** Requests are done in their order, each after the last one's end. */
let queue: Promise<void> = Promise.resolve();

self.onmessage = (event: MessageEvent<{ id: number; request: Request }>) => {
  const { id, request } = event.data;
  queue = queue.then(async () => {
    try {
      const result = await work(id, request);
      send({ id, result }, buffers(result));
    } catch (error) {
      const trapped = error instanceof WebAssembly.RuntimeError;
      const reason = error instanceof Error ? error.message : String(error);
      send({ id, error: trapped ? `the engine stopped (${reason}); is there enough memory?` : reason });
    }
  });
};
