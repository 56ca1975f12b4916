/** What every reader gives. */

export type Vector = [number, number, number];

export interface CloudData {
  name: string;
  /** The file's format, in words. */
  format: string;
  count: number;
  /** Offsets from `origin`, (n, 3), row by row, all finite. */
  positions: Float32Array<ArrayBuffer>;
  origin: Vector;
  /** Red, green, blue from 0 to 255, (n, 3). */
  colours: Uint8Array<ArrayBuffer> | null;
  /** Other numbers of each point, by name. */
  fields: Record<string, Float32Array<ArrayBuffer>>;
  viewpoint: Vector | null;
  /** Points that were left out since their coordinates are not finite. */
  left_out: number;
}

/** Numbers of points as a format holds them, one array for each column. */
export interface Columns {
  format: string;
  names: string[];
  columns: ArrayLike<number>[];
  /** Full scale of the colours' columns: 255, 65535 or 1. */
  colourScale?: number;
  viewpoint?: Vector | null;
}

/** What a reader says about a file that it cannot read. */
export class FileError extends Error {}

/** Coordinates that are this many extents from 0 are held as offsets from a round origin. */
const FAR_FROM_ZERO = 8;

/** Columns that are kept beside coordinates and colours. */
const MOST_FIELDS = 24;

const COLOUR_NAMES = [
  ["red", "green", "blue"],
  ["r", "g", "b"],
  ["diffuse_red", "diffuse_green", "diffuse_blue"],
];

/** Makes a cloud of columns, among which must be x, y and z. */
export function cloudOf(name: string, data: Columns): CloudData {
  const { format, columns } = data;
  const names = data.names.map((column) => column.toLowerCase());
  const [x, y, z] = ["x", "y", "z"].map((axis) => {
    const column = names.indexOf(axis);
    if (column < 0) throw new FileError(`${name}: the ${format} has no column ${axis}`);
    return columns[column];
  });
  const kept = finiteNumbers(x, y, z);
  if (kept.length === 0) throw new FileError(`${name}: the ${format} holds no point with finite coordinates`);
  const origin = originOf([x, y, z], kept);
  const positions = new Float32Array(3 * kept.length);
  for (let i = 0; i < kept.length; i++) {
    positions[3 * i] = x[kept[i]] - origin[0];
    positions[3 * i + 1] = y[kept[i]] - origin[1];
    positions[3 * i + 2] = z[kept[i]] - origin[2];
  }
  const used = new Set(["x", "y", "z"]);
  const colourNames = COLOUR_NAMES.find((three) => three.every((colour) => names.includes(colour)));
  let colours: Uint8Array<ArrayBuffer> | null = null;
  if (colourNames !== undefined) {
    const channels = colourNames.map((colour) => columns[names.indexOf(colour)]);
    colourNames.forEach((colour) => used.add(colour));
    colours = coloursOf(channels, kept, data.colourScale);
  }
  const fields: CloudData["fields"] = {};
  names.forEach((column, number) => {
    if (used.has(column) || Object.keys(fields).length >= MOST_FIELDS) return;
    fields[column] = Float32Array.from(kept, (i) => columns[number][i]);
  });
  return {
    name,
    format,
    count: kept.length,
    positions,
    origin,
    colours,
    fields,
    viewpoint: data.viewpoint ?? null,
    left_out: x.length - kept.length,
  };
}

function finiteNumbers(x: ArrayLike<number>, y: ArrayLike<number>, z: ArrayLike<number>): Uint32Array {
  const kept = new Uint32Array(x.length);
  let count = 0;
  // A sum that is finite has finite terms, but for infinities of both signs, which give NaN.
  for (let i = 0; i < x.length; i++) if (Number.isFinite(x[i] + y[i] + z[i])) kept[count++] = i;
  return kept.subarray(0, count);
}

/** A round place near points that float32 numbers cannot hold exactly; 0 where they can. */
function originOf(axes: ArrayLike<number>[], kept: Uint32Array): Vector {
  const bounds = axes.map((axis) => {
    let [low, high] = [Infinity, -Infinity];
    for (const i of kept) {
      low = Math.min(low, axis[i]);
      high = Math.max(high, axis[i]);
    }
    return [low, high];
  });
  const extent = Math.max(...bounds.map(([low, high]) => high - low));
  const middle = bounds.map(([low, high]) => (low + high) / 2) as Vector;
  const far = Math.max(...middle.map(Math.abs)) > FAR_FROM_ZERO * extent;
  if (!far && axes.every((axis) => axis instanceof Float32Array)) return [0, 0, 0];
  const step = extent > 0 ? 10 ** Math.floor(Math.log10(extent)) : 1;
  return middle.map((value) => Math.round(value / step) * step) as Vector;
}

function coloursOf(
  channels: ArrayLike<number>[],
  kept: Uint32Array,
  scale?: number,
): Uint8Array<ArrayBuffer> {
  let full = scale;
  if (full === undefined) {
    let largest = 0;
    for (const channel of channels) for (const i of kept) largest = Math.max(largest, channel[i]);
    full = largest <= 1 ? 1 : largest <= 255 ? 255 : 65535;
  }
  const colours = new Uint8Array(3 * kept.length);
  for (let i = 0; i < kept.length; i++) {
    for (let c = 0; c < 3; c++) colours[3 * i + c] = Math.round((255 * channels[c][kept[i]]) / full);
  }
  return colours;
}
