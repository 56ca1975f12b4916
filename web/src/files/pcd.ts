/** PCD of PCL: ASCII, binary, and compressed by LZF. */

import { checkLength, column, sizeOf, type Type } from "./binary.js";
import { type Columns, FileError, type Vector } from "./cloud.js";

const LONGEST_HEADER = 65536;

interface Field {
  name: string;
  type: Type;
  count: number;
}

export function readPcd(name: string, bytes: Uint8Array<ArrayBuffer>): Columns {
  const text = new TextDecoder("latin1").decode(bytes.subarray(0, LONGEST_HEADER));
  const end = /^DATA[ \t]+(\S+)[ \t]*\r?\n/m.exec(text);
  if (end === null) throw new FileError(`${name}: the PCD header has no DATA line`);
  const header: Record<string, string[]> = {};
  for (const line of text.slice(0, end.index).split(/\r?\n/)) {
    const [key, ...words] = line.trim().split(/\s+/);
    if (key !== "" && !key.startsWith("#")) header[key] = words;
  }
  const fields = fieldsOf(name, header);
  const [width, height] = [Number(header.WIDTH?.[0]), Number(header.HEIGHT?.[0] ?? 1)];
  const count = header.POINTS === undefined ? width * height : Number(header.POINTS[0]);
  if (!Number.isInteger(count) || count < 0)
    throw new FileError(`${name}: the PCD header has no number of points`);
  const start = end.index + end[0].length;
  const data = end[1].toLowerCase();
  const columns =
    data === "ascii"
      ? asciiColumns(name, bytes.subarray(start), fields, count)
      : data === "binary"
        ? rowColumns(name, bytes.subarray(start), fields, count)
        : data === "binary_compressed"
          ? planeColumns(name, decompressed(name, bytes.subarray(start)), fields, count)
          : null;
  if (columns === null) throw new FileError(`${name}: PCD data "${data}" are not known`);
  const names = fields.map((field) => field.name);
  const packed = names.findIndex((field) => field === "rgb" || field === "rgba");
  let colourScale: number | undefined;
  if (packed >= 0) {
    const words = packedColours(columns[packed], fields[packed].type);
    names.splice(packed, 1, "red", "green", "blue");
    columns.splice(
      packed,
      1,
      ...[16, 8, 0].map((bits) => Float32Array.from(words, (w) => (w >> bits) & 255)),
    );
    colourScale = 255;
  }
  return {
    format: `PCD (${data.replace("_", " ")})`,
    names,
    columns,
    colourScale,
    viewpoint: viewpointOf(header),
  };
}

function fieldsOf(name: string, header: Record<string, string[]>): Field[] {
  const { FIELDS, SIZE, TYPE } = header;
  if (FIELDS === undefined || SIZE?.length !== FIELDS.length || TYPE?.length !== FIELDS.length) {
    throw new FileError(`${name}: FIELDS, SIZE and TYPE of the PCD header do not agree`);
  }
  return FIELDS.map((field, i) => ({
    name: field,
    type: `${TYPE[i].toLowerCase()}${SIZE[i]}` as Type,
    count: Number(header.COUNT?.[i] ?? 1),
  }));
}

/** The default, (0, 0, 0), says nothing. */
function viewpointOf(header: Record<string, string[]>): Vector | null {
  const place = (header.VIEWPOINT ?? []).slice(0, 3).map(Number);
  return place.length === 3 && place.every(Number.isFinite) && place.some((c) => c !== 0)
    ? (place as Vector)
    : null;
}

function rowColumns(
  name: string,
  bytes: Uint8Array<ArrayBuffer>,
  fields: Field[],
  count: number,
): Float32Array[] {
  const stride = fields.reduce((sum, field) => sum + sizeOf(field.type) * field.count, 0);
  checkLength(name, bytes.length, stride * count, `${count} points`);
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  let start = 0;
  return fields.map((field) => {
    const values = column(view, field.type, start, stride, count);
    start += sizeOf(field.type) * field.count;
    return values as Float32Array;
  });
}

/** Compressed data hold one column behind the other. */
function planeColumns(
  name: string,
  bytes: Uint8Array<ArrayBuffer>,
  fields: Field[],
  count: number,
): Float32Array[] {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const needed = fields.reduce((sum, field) => sum + sizeOf(field.type) * field.count * count, 0);
  checkLength(name, bytes.length, needed, `${count} points`);
  let start = 0;
  return fields.map((field) => {
    const size = sizeOf(field.type) * field.count;
    const values = column(view, field.type, start, size, count);
    start += size * count;
    return values as Float32Array;
  });
}

function asciiColumns(name: string, bytes: Uint8Array, fields: Field[], count: number): Float32Array[] {
  const lines = new TextDecoder("latin1").decode(bytes).trimEnd().split("\n");
  if (lines.length < count)
    throw new FileError(`${name}: cut off: ${lines.length} of ${count} points are there`);
  const columns = fields.map((field) =>
    ["f4", "i1", "u1", "i2", "u2"].includes(field.type) ? new Float32Array(count) : new Float64Array(count),
  );
  for (let i = 0; i < count; i++) {
    const words = lines[i].trim().split(/\s+/);
    let word = 0;
    fields.forEach((field, c) => {
      columns[c][i] = Number(words[word]);
      word += field.count;
    });
  }
  return columns as Float32Array[];
}

/** Three bytes in the bits of a float or in an integer. */
function packedColours(values: ArrayLike<number>, type: Type): Uint32Array {
  if (type === "f4") {
    const floats = Float32Array.from(values);
    return new Uint32Array(floats.buffer);
  }
  return Uint32Array.from(values);
}

function decompressed(name: string, bytes: Uint8Array<ArrayBuffer>): Uint8Array<ArrayBuffer> {
  checkLength(name, bytes.length, 8, "the sizes of compressed data");
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const [from, to] = [view.getUint32(0, true), view.getUint32(4, true)];
  checkLength(name, bytes.length - 8, from, "compressed data");
  return lzf(name, bytes.subarray(8, 8 + from), to);
}

/** LZF: a run of literals, or a copy of what came before. */
function lzf(name: string, input: Uint8Array, size: number): Uint8Array<ArrayBuffer> {
  const output = new Uint8Array(size);
  let [from, to] = [0, 0];
  while (from < input.length) {
    const control = input[from++];
    if (control < 32) {
      const run = control + 1;
      output.set(input.subarray(from, from + run), to);
      from += run;
      to += run;
    } else {
      let length = control >> 5;
      if (length === 7) length += input[from++];
      let reference = to - ((control & 31) << 8) - input[from++] - 1;
      if (reference < 0 || to + length + 2 > size) throw new FileError(`${name}: compressed data are broken`);
      for (let i = 0; i < length + 2; i++) output[to++] = output[reference++];
    }
  }
  if (to !== size) throw new FileError(`${name}: compressed data are broken`);
  return output;
}
