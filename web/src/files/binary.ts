/** Numbers in bytes: types by name, and columns out of rows of bytes. */

import { FileError } from "./cloud.js";

export type Type = "i1" | "u1" | "i2" | "u2" | "i4" | "u4" | "f4" | "f8" | "i8" | "u8";

export const sizeOf = (type: Type): number => Number(type[1]);

type Column = Float32Array | Float64Array;

/** Room for a column that loses nothing of its numbers. */
export const columnFor = (type: Type, count: number): Column =>
  type === "f8" || type === "i4" || type === "u4" || type === "i8" || type === "u8"
    ? new Float64Array(count)
    : new Float32Array(count);

/** What reads a number of a type at some byte. */
export function getter(view: DataView, type: Type, little: boolean): (at: number) => number {
  switch (type) {
    case "i1":
      return (at) => view.getInt8(at);
    case "u1":
      return (at) => view.getUint8(at);
    case "i2":
      return (at) => view.getInt16(at, little);
    case "u2":
      return (at) => view.getUint16(at, little);
    case "i4":
      return (at) => view.getInt32(at, little);
    case "u4":
      return (at) => view.getUint32(at, little);
    case "f4":
      return (at) => view.getFloat32(at, little);
    case "f8":
      return (at) => view.getFloat64(at, little);
    case "i8":
      return (at) => Number(view.getBigInt64(at, little));
    case "u8":
      return (at) => Number(view.getBigUint64(at, little));
  }
}

/** One column of rows that are `stride` bytes apart. */
export function column(
  view: DataView,
  type: Type,
  start: number,
  stride: number,
  count: number,
  little = true,
): Column {
  const values = columnFor(type, count);
  const get = getter(view, type, little);
  for (let i = 0; i < count; i++) values[i] = get(start + i * stride);
  return values;
}

/** Refuses a file that ends before its last row. */
export function checkLength(name: string, present: number, needed: number, what: string): void {
  if (present < needed) {
    throw new FileError(`${name}: cut off: ${what} need ${needed} bytes, and ${present} are there`);
  }
}
