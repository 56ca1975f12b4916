/** The page's side of the worker: promises, progress, and cancelling. */

import type { Answer, Request, Results } from "./messages.js";

/** Work that was cancelled: no mistake, and nothing to tell. */
export class Cancelled extends Error {}

interface Waiting {
  resolve(result: unknown): void;
  reject(error: Error): void;
  progress?: (share: number) => void;
  kind: Request["kind"];
}

type Load = Extract<Request, { kind: "load" }>;

export class Engine {
  private worker: Worker;
  private number = 0;
  private readonly waiting = new Map<number, Waiting>();
  /** The cloud, to be loaded again into the worker that follows one that was stopped. */
  private loaded: Load | null = null;

  constructor(
    private readonly script: string,
    private readonly wasm: ArrayBuffer,
  ) {
    this.worker = this.started();
  }

  private started(): Worker {
    const worker = new Worker(this.script);
    worker.onmessage = (event: MessageEvent<Answer>) => this.answered(event.data);
    worker.onerror = (event) => this.fail(new Error(event.message || "the worker stopped"));
    this.worker = worker;
    // Whatever is asked next fails with the reason.
    this.ask({ kind: "start", engine: this.wasm }).catch(() => undefined);
    return worker;
  }

  private answered(answer: Answer): void {
    const waiting = this.waiting.get(answer.id);
    if (waiting === undefined) return;
    if ("progress" in answer) {
      waiting.progress?.(answer.progress);
      return;
    }
    this.waiting.delete(answer.id);
    if ("error" in answer) waiting.reject(new Error(answer.error));
    else waiting.resolve(answer.result);
  }

  private fail(error: Error): void {
    for (const waiting of this.waiting.values()) waiting.reject(error);
    this.waiting.clear();
  }

  /** Asks the worker for something. */
  ask<K extends keyof Results>(
    request: Extract<Request, { kind: K }>,
    progress?: (share: number) => void,
    transfer: Transferable[] = [],
  ): Promise<Results[K]> {
    const id = ++this.number;
    if (request.kind === "load") this.loaded = request as Load;
    return new Promise((resolve, reject) => {
      this.waiting.set(id, {
        resolve: resolve as (result: unknown) => void,
        reject,
        progress,
        kind: request.kind,
      });
      this.worker.postMessage({ id, request }, transfer);
    });
  }

  /** Whether the worker does something that can be stopped: its own start takes as long again. */
  get busy(): boolean {
    return [...this.waiting.values()].some(({ kind }) => kind !== "start");
  }

  /** Stops whatever runs, and starts again with the same cloud. What was extracted there is gone. */
  cancel(): void {
    if (!this.busy) return;
    this.worker.terminate();
    this.fail(new Cancelled("cancelled"));
    this.started();
    if (this.loaded !== null) void this.ask(this.loaded).catch(() => undefined);
  }
}
