/** Rows of numbers in text: XYZ, PTS, CSV and the like; and the vertices of OBJ. */

import { type Columns, FileError } from "./cloud.js";

const COMMENT = /^\s*(#|\/\/|%)/;
const SEPARATOR = /[\s,;]+/;

/** Names of a header's columns that mean a coordinate. */
const COORDINATES: Record<string, string> = { easting: "x", northing: "y", elevation: "z", height: "z" };

/** Lines that may stand before the first row of numbers. */
const MOST_HEADER_LINES = 20;

export function readText(name: string, bytes: Uint8Array): Columns {
  const lines = new TextDecoder().decode(bytes).split("\n");
  const words = (line: string): string[] => line.trim().split(SEPARATOR).filter(Boolean);
  let names: string[] | null = null;
  let first = 0;
  // A header of names, or the number of points that PTS begins with, may come first.
  for (; first < lines.length; first++) {
    const line = lines[first];
    const row = words(line.replace(/^\s*(#|\/\/)/, ""));
    if (row.length === 0) continue;
    if (!COMMENT.test(line) && row.length >= 3 && row.every((word) => isNumber(word))) break;
    if (row.length >= 3 && row.some((word) => /[a-z]/i.test(word))) {
      names = row.map((word) => word.replace(/["']/g, "").toLowerCase());
    }
    if (first > MOST_HEADER_LINES) throw new FileError(`${name}: neither a known format nor rows of numbers`);
  }
  if (first >= lines.length) throw new FileError(`${name}: neither a known format nor rows of numbers`);
  const width = words(lines[first]).length;
  const columns: number[][] = Array.from({ length: width }, () => []);
  for (let number = first; number < lines.length; number++) {
    const line = lines[number];
    if (line.trim() === "" || COMMENT.test(line)) continue;
    const row = words(line);
    if (row.length < 3)
      throw new FileError(`${name}: line ${number + 1} has ${row.length} numbers, not ${width}`);
    for (let c = 0; c < width; c++) columns[c].push(Number(row[c] ?? NaN));
  }
  return { format: "text", names: namesOf(names, width, columns), columns };
}

function isNumber(word: string): boolean {
  return !Number.isNaN(Number(word)) || /^[-+]?(nan|inf)/i.test(word);
}

function namesOf(header: string[] | null, width: number, columns: number[][]): string[] {
  const named = header?.map((word) => COORDINATES[word] ?? word);
  if (
    named !== undefined &&
    named.length === width &&
    ["x", "y", "z"].every((axis) => named.includes(axis))
  ) {
    return named;
  }
  const names = ["x", "y", "z", ...Array.from({ length: width - 3 }, (_, i) => `column ${i + 4}`)];
  // Three last columns of whole numbers up to 255 are colours: x y z r g b, and PTS's x y z intensity r g b.
  const last = columns.slice(-3);
  const isColour = last.every((column) => column.every((v) => Number.isInteger(v) && v >= 0 && v <= 255));
  if (width >= 6 && isColour) names.splice(width - 3, 3, "red", "green", "blue");
  return names;
}

export function readObj(name: string, bytes: Uint8Array): Columns {
  const rows: number[][] = [];
  for (const line of new TextDecoder().decode(bytes).split("\n")) {
    if (/^\s*v\s/.test(line)) rows.push(line.trim().split(/\s+/).slice(1).map(Number));
  }
  if (rows.length === 0) throw new FileError(`${name}: the OBJ file has no vertices`);
  const coloured = rows.every((row) => row.length >= 6);
  const names = coloured ? ["x", "y", "z", "red", "green", "blue"] : ["x", "y", "z"];
  return { format: "OBJ", names, columns: names.map((_, c) => rows.map((row) => row[c])) };
}
