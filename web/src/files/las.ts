/** LAS 1.0 to 1.4, and LAZ, whose points laz-perf decompresses. */

import { createLazPerf } from "laz-perf/lib/worker";
import lazPerfBinary from "laz-perf/lib/laz-perf.wasm";
import { checkLength } from "./binary.js";
import { type Columns, FileError } from "./cloud.js";

/** Where the colours of each point format are; the others have none. */
const COLOURS_AT: Record<number, number> = { 2: 20, 3: 28, 5: 28, 7: 30, 8: 30, 10: 30 };

/** Bit of the point format that says that the points are compressed. */
const COMPRESSED = 0x80;

export async function readLas(name: string, bytes: Uint8Array<ArrayBuffer>): Promise<Columns> {
  checkLength(name, bytes.length, 227, "the LAS header");
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const minor = view.getUint8(25);
  const compressed = (view.getUint8(104) & COMPRESSED) !== 0;
  const format = view.getUint8(104) & 0x3f;
  const stride = view.getUint16(105, true);
  let count = view.getUint32(107, true);
  if (minor >= 4 && bytes.length >= 255) count = Number(view.getBigUint64(247, true)) || count;
  if (format > 10) throw new FileError(`${name}: the LAS point format ${format} is not known`);
  const double = (at: number): number => view.getFloat64(at, true);
  const scales = [131, 139, 147].map(double);
  const offsets = [155, 163, 171].map(double);
  let rows = view;
  let start = view.getUint32(96, true);
  if (compressed) {
    const points = await decompressed(name, bytes, stride, count);
    [rows, start] = [new DataView(points.buffer), 0];
  }
  checkLength(name, rows.byteLength - start, stride * count, `${count} points`);
  const coordinates = [0, 1, 2].map(() => new Float64Array(count));
  const [intensity, classification] = [new Float32Array(count), new Float32Array(count)];
  const coloursAt = COLOURS_AT[format];
  const colours = coloursAt === undefined ? [] : [0, 1, 2].map(() => new Float32Array(count));
  const classAt = format >= 6 ? 16 : 15;
  for (let i = 0; i < count; i++) {
    const at = start + i * stride;
    for (let axis = 0; axis < 3; axis++) {
      coordinates[axis][i] = rows.getInt32(at + 4 * axis, true) * scales[axis] + offsets[axis];
    }
    intensity[i] = rows.getUint16(at + 12, true);
    classification[i] = rows.getUint8(at + classAt) & (format >= 6 ? 0xff : 0x1f);
    for (let c = 0; c < colours.length; c++) colours[c][i] = rows.getUint16(at + coloursAt + 2 * c, true);
  }
  const names = ["x", "y", "z", "intensity", "classification"];
  return {
    format: `${compressed ? "LAZ" : "LAS"} 1.${minor}, point format ${format}`,
    names: colours.length > 0 ? [...names, "red", "green", "blue"] : names,
    columns: [...coordinates, intensity, classification, ...colours],
  };
}

async function decompressed(
  name: string,
  bytes: Uint8Array,
  stride: number,
  count: number,
): Promise<Uint8Array<ArrayBuffer>> {
  const module = await createLazPerf({ wasmBinary: lazPerfBinary.slice().buffer });
  const file = module._malloc(bytes.length);
  const point = module._malloc(stride);
  const reader = new module.LASZip();
  try {
    module.HEAPU8.set(bytes, file);
    reader.open(file, bytes.length);
    const points = new Uint8Array(stride * count);
    for (let i = 0; i < count; i++) {
      reader.getPoint(point);
      points.set(module.HEAPU8.subarray(point, point + stride), i * stride);
    }
    return points;
  } catch (error) {
    const reason = error instanceof Error ? `: ${error.message}` : "";
    throw new FileError(`${name}: the LAZ file's points cannot be decompressed${reason}; is it cut off?`);
  } finally {
    reader.delete();
    module._free(file);
    module._free(point);
  }
}
