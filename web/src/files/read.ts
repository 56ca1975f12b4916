/** Reads a file by what it holds, not by its name. */

import { type CloudData, cloudOf, FileError } from "./cloud.js";
import { readLas } from "./las.js";
import { readPcd } from "./pcd.js";
import { readPly } from "./ply.js";
import { readObj, readText } from "./text.js";

/** Endings of the files that can be chosen. */
export const ENDINGS = [".ply", ".pcd", ".las", ".laz", ".obj", ".xyz", ".txt", ".csv", ".pts", ".asc"];

/** Formats that are known, and not read here. */
const ELSEWHERE: [RegExp, string][] = [
  [/^ASTM-E57/, "an E57 file"],
  [/^glTF/, "a binary glTF file"],
  [/^PK\x03\x04/, "a ZIP archive"],
  [/^\x1f\x8b/, "a gzip archive"],
  [/^\x89PNG|^\xff\xd8\xff/, "a picture"],
  [/^\s*<(!doctype|html|\?xml)/i, "a web page or XML"],
  [/^%PDF/, "a PDF"],
];

export async function readCloud(name: string, data: ArrayBuffer): Promise<CloudData> {
  const bytes = new Uint8Array(data);
  if (bytes.length === 0) throw new FileError(`${name}: the file is empty`);
  const start = new TextDecoder("latin1").decode(bytes.subarray(0, 512));
  if (/^ply\s/.test(start)) return cloudOf(name, readPly(name, bytes));
  if (start.startsWith("LASF")) return cloudOf(name, await readLas(name, bytes));
  if (/^(#[^\n]*\n)*\s*(VERSION|FIELDS)\s/.test(start)) return cloudOf(name, readPcd(name, bytes));
  const other = ELSEWHERE.find(([pattern]) => pattern.test(start));
  if (other !== undefined) {
    const advice = other[1].includes("E57") ? "; `surfsig convert` makes a PLY file of it" : "";
    throw new FileError(`${name}: holds ${other[1]}, not a point cloud that this page reads${advice}`);
  }
  if (start.includes("\0")) throw new FileError(`${name}: a binary file of no format that this page reads`);
  if (/^\s*(mtllib|v|vn|o|g)\s/m.test(start) || name.toLowerCase().endsWith(".obj")) {
    return cloudOf(name, readObj(name, bytes));
  }
  return cloudOf(name, readText(name, bytes));
}
