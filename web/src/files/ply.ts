/** PLY, ASCII and binary. Of elements other than vertices only the size counts. */

import { checkLength, column, columnFor, getter, sizeOf, type Type } from "./binary.js";
import { type Columns, FileError, type Vector } from "./cloud.js";

const TYPES: Record<string, Type> = {
  char: "i1",
  int8: "i1",
  uchar: "u1",
  uint8: "u1",
  short: "i2",
  int16: "i2",
  ushort: "u2",
  uint16: "u2",
  int: "i4",
  int32: "i4",
  uint: "u4",
  uint32: "u4",
  float: "f4",
  float32: "f4",
  double: "f8",
  float64: "f8",
};

interface Property {
  name: string;
  type: Type;
  /** Type of the length, of a list. */
  length: Type | null;
}

interface Element {
  name: string;
  count: number;
  properties: Property[];
}

interface Header {
  format: "ascii" | "binary_little_endian" | "binary_big_endian";
  elements: Element[];
  viewpoint: Vector | null;
  /** Where the data start. */
  end: number;
}

/** Bytes that a header may have. */
const LONGEST_HEADER = 65536;

export function readPly(name: string, bytes: Uint8Array<ArrayBuffer>): Columns {
  const header = headerOf(name, bytes);
  const place = header.elements.findIndex((element) => element.name === "vertex");
  if (place < 0) throw new FileError(`${name}: the PLY file has no vertices`);
  const vertices = header.elements[place];
  if (vertices.properties.some((property) => property.length !== null)) {
    throw new FileError(`${name}: the PLY file's vertices have lists`);
  }
  const before = header.elements.slice(0, place);
  const columns =
    header.format === "ascii"
      ? asciiColumns(name, bytes, header, before, vertices)
      : binaryColumns(name, bytes, header, before, vertices);
  const colour = vertices.properties.find((property) => /^(diffuse_)?red$/.test(property.name));
  const scale = { u1: 255, u2: 65535, f4: 1, f8: 1 }[colour?.type as string];
  return {
    format: `PLY (${header.format.replaceAll("_", " ")})`,
    names: vertices.properties.map((property) => property.name),
    columns,
    colourScale: scale,
    viewpoint: header.viewpoint,
  };
}

function headerOf(name: string, bytes: Uint8Array): Header {
  const text = new TextDecoder("latin1").decode(bytes.subarray(0, LONGEST_HEADER));
  const end = /\nend_header[ \t]*\r?\n/.exec(text);
  if (end === null) throw new FileError(`${name}: the PLY header has no end_header`);
  let format: Header["format"] | null = null;
  const elements: Element[] = [];
  let viewpoint: Vector | null = null;
  for (const line of text.slice(0, end.index).split(/\r?\n|\r/)) {
    const words = line.trim().split(/\s+/);
    if (words[0] === "format") {
      if (!["ascii", "binary_little_endian", "binary_big_endian"].includes(words[1])) {
        throw new FileError(`${name}: the PLY format "${words[1]}" is not known`);
      }
      format = words[1] as Header["format"];
    } else if (words[0] === "element") {
      const count = Number(words[2]);
      if (!Number.isInteger(count) || count < 0)
        throw new FileError(`${name}: bad PLY header line "${line}"`);
      elements.push({ name: words[1], count, properties: [] });
    } else if (words[0] === "comment" && words[2] === "viewpoint") {
      // As surfsig writes it: comment surfsig viewpoint X Y Z.
      const place = words.slice(3, 6).map(Number);
      if (place.length === 3 && place.every(Number.isFinite)) viewpoint = place as Vector;
    } else if (words[0] === "property") {
      const isList = words[1] === "list";
      const types = words.slice(isList ? 2 : 1, -1).map((word) => TYPES[word]);
      if (types.includes(undefined as never) || elements.length === 0 || types.length !== (isList ? 2 : 1)) {
        throw new FileError(`${name}: bad PLY header line "${line}"`);
      }
      const property = { name: words[words.length - 1], type: types[types.length - 1] };
      elements[elements.length - 1].properties.push({ ...property, length: isList ? types[0] : null });
    }
  }
  if (format === null) throw new FileError(`${name}: the PLY header names no format`);
  return { format, elements, viewpoint, end: end.index + end[0].length };
}

function binaryColumns(
  name: string,
  bytes: Uint8Array<ArrayBuffer>,
  header: Header,
  before: Element[],
  vertices: Element,
): ArrayLike<number>[] {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const little = header.format === "binary_little_endian";
  let start = header.end;
  for (const element of before) start = afterElement(name, view, element, start, little);
  const stride = vertices.properties.reduce((sum, property) => sum + sizeOf(property.type), 0);
  checkLength(name, bytes.length - start, stride * vertices.count, `${vertices.count} vertices`);
  return vertices.properties.map(({ type }) => {
    const values = column(view, type, start, stride, vertices.count, little);
    start += sizeOf(type);
    return values;
  });
}

function afterElement(
  name: string,
  view: DataView,
  element: Element,
  start: number,
  little: boolean,
): number {
  let at = start;
  for (let i = 0; i < element.count; i++) {
    for (const { type, length } of element.properties) {
      if (length === null) at += sizeOf(type);
      else {
        checkLength(name, view.byteLength - at, sizeOf(length), `the list of ${element.name} ${i}`);
        at += sizeOf(length) + getter(view, length, little)(at) * sizeOf(type);
      }
    }
  }
  return at;
}

function asciiColumns(
  name: string,
  bytes: Uint8Array,
  header: Header,
  before: Element[],
  vertices: Element,
): ArrayLike<number>[] {
  const lines = new TextDecoder("latin1").decode(bytes.subarray(header.end)).split("\n");
  const skipped = before.reduce((sum, element) => sum + element.count, 0);
  const columns = vertices.properties.map(({ type }) => columnFor(type, vertices.count));
  for (let i = 0; i < vertices.count; i++) {
    const words = (lines[skipped + i] ?? "").trim().split(/\s+/);
    if (words.length < columns.length)
      throw new FileError(`${name}: vertex ${i} of ${vertices.count} is cut off`);
    for (let c = 0; c < columns.length; c++) {
      const value = Number(words[c]);
      if (Number.isNaN(value) && !/^[-+]?nan/i.test(words[c])) {
        throw new FileError(`${name}: vertex ${i}: "${words[c]}" is no number`);
      }
      columns[c][i] = value;
    }
  }
  return columns;
}
