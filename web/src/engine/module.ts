/** The core in WebAssembly: its memory, its functions, and its errors. */

type Call = (...numbers: number[]) => number;

/** A call that the core refused, with its reason. */
export class EngineError extends Error {}

/** What a progress function says: false stops the work. */
export type Progress = (done: number, total: number) => boolean;

const CANCELLED = 5;
const WORD = 4;

/** Bytes of a module that exports its import "p" again, of type (i32, i32, i32) -> i32: tables hold only such. */
const TRAMPOLINE = new Uint8Array([
  0, 97, 115, 109, 1, 0, 0, 0, 1, 8, 1, 96, 3, 127, 127, 127, 1, 127, 2, 7, 1, 1, 101, 1, 112, 0, 0, 7, 5, 1,
  1, 112, 0, 0,
]);

/** Memory of the caller's inside the module, to be released. */
export interface Buffer {
  readonly pointer: number;
  readonly bytes: number;
}

export class EngineModule {
  private readonly memory: WebAssembly.Memory;
  private readonly functions: Record<string, Call>;
  private progress: Progress | null = null;
  /** Number of the progress function in the module's table. */
  readonly progressPointer: number;

  private constructor(instance: WebAssembly.Instance) {
    this.memory = instance.exports.memory as WebAssembly.Memory;
    this.functions = instance.exports as Record<string, Call>;
    const table = instance.exports.__indirect_function_table as WebAssembly.Table;
    const report = (_: number, done: number, total: number): number =>
      this.progress === null || this.progress(done, total) ? 0 : 1;
    const trampoline = new WebAssembly.Instance(new WebAssembly.Module(TRAMPOLINE), { e: { p: report } });
    this.progressPointer = table.grow(1, trampoline.exports.p);
  }

  static async load(bytes: BufferSource): Promise<EngineModule> {
    const { instance } = await WebAssembly.instantiate(bytes, {});
    return new EngineModule(instance);
  }

  /** Calls a function that gives a number. */
  value(name: string, ...numbers: number[]): number {
    return this.functions[name](...numbers);
  }

  /** Calls a function that gives a code; throws the core's reason where it failed. */
  call(name: string, ...numbers: number[]): void {
    const code = this.functions[name](...numbers);
    if (code === CANCELLED) throw new EngineError("cancelled");
    if (code !== 0) throw new EngineError(this.text(this.functions.surfsig_last_error()));
  }

  /** Does some work whose progress is reported. */
  watched<T>(progress: Progress, work: () => T): T {
    this.progress = progress;
    try {
      return work();
    } finally {
      this.progress = null;
    }
  }

  allocate(bytes: number): Buffer {
    if (bytes === 0) return { pointer: 0, bytes: 0 };
    const pointer = this.functions.surfsig_allocate(bytes) >>> 0;
    if (pointer === 0)
      throw new EngineError(`the browser has no memory for ${Math.round(bytes / 1e6)} MB more`);
    return { pointer, bytes };
  }

  release(buffer: Buffer): void {
    this.functions.surfsig_release(buffer.pointer, buffer.bytes);
  }

  /** A copy of numbers inside the module. */
  put(numbers: Float32Array | Float64Array | Uint32Array | Uint8Array): Buffer {
    const buffer = this.allocate(numbers.byteLength);
    const bytes = new Uint8Array(numbers.buffer, numbers.byteOffset, numbers.byteLength);
    new Uint8Array(this.memory.buffer, buffer.pointer, buffer.bytes).set(bytes);
    return buffer;
  }

  /** Makes an object by a function that puts its pointer into the last argument. */
  make(name: string, ...numbers: number[]): number {
    const slot = this.allocate(WORD);
    try {
      this.call(name, ...numbers, slot.pointer);
      return new Uint32Array(this.memory.buffer, slot.pointer, 1)[0];
    } finally {
      this.release(slot);
    }
  }

  floats(pointer: number, count: number): Float32Array<ArrayBuffer> {
    return new Float32Array(this.memory.buffer as ArrayBuffer, pointer >>> 0, count).slice();
  }

  doubles(pointer: number, count: number): Float64Array<ArrayBuffer> {
    return new Float64Array(this.memory.buffer as ArrayBuffer, pointer >>> 0, count).slice();
  }

  integers(pointer: number, count: number): Int32Array<ArrayBuffer> {
    return new Int32Array(this.memory.buffer as ArrayBuffer, pointer >>> 0, count).slice();
  }

  bytes(pointer: number, count: number): Uint8Array<ArrayBuffer> {
    return new Uint8Array(this.memory.buffer as ArrayBuffer, pointer >>> 0, count).slice();
  }

  text(pointer: number): string {
    const bytes = new Uint8Array(this.memory.buffer, pointer >>> 0);
    return new TextDecoder().decode(bytes.slice(0, bytes.indexOf(0)));
  }
}
